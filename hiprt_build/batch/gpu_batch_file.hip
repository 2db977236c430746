#include <hiprt_build/gpu/batch.h>

#include <hiprt_build/gpu/objects.h>
#include <hiprt_build/instances/pack_object.h>

#include <new>

namespace hiprt::gpu {

Result<build::Buffer> download_file(const BatchScenes& scenes, std::uint32_t number, hipStream_t stream,
                                    Allocator& allocator) {
  if (number >= scenes.count)
    return fail(ErrorCode::kInvalidInput, "download_file: scene ", number, ", the batch has ", scenes.count);
  // All scenes of a batch lie in one allocation. The copy holds this one only.
  const auto one = compact_batch({scenes.views + number, scenes.report, scenes.counts + number, 1}, stream, allocator);
  if (!one) return tl::unexpected(one.error());
  auto record = DeviceArray<ObjectRecord>::make(1, stream, allocator);
  if (!record) return tl::unexpected(std::move(record.error()));
  if (auto done = enqueue_objects(one->scenes.views, 1, record->data(), stream); !done)
    return tl::unexpected(std::move(done.error()));
  try {
    ObjectRecord there;
    std::vector<std::byte> memory(one->buffer.size());
    auto done = record->download({&there, 1}, stream);
    if (done) done = one->buffer.download(memory, stream);
    if (done) done = check(hipStreamSynchronize(stream), "hipStreamSynchronize");
    if (!done) return tl::unexpected(std::move(done.error()));
    auto packed = build::pack_object(memory, {}, there, static_cast<NodeLayout>(there.reserved), 0.0f, 0.0f, {});
    if (!packed) return tl::unexpected(std::move(packed.error()));
    return std::move(packed->file);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory, "no host memory for the file of a scene");
  }
}

}  // namespace hiprt::gpu
