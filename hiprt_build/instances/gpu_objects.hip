#include <hiprt_build/gpu/objects.h>

#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/pipeline/gpu_state.h>

#include <algorithm>

namespace hiprt::build::kernels {
namespace {

/// Arguments of put_objects().
struct ObjectChunk {
  static constexpr unsigned kSize = 16;
  gpu::ObjectSource sources[kSize];
};

HIPRT_HD std::uint64_t offset_in(const SceneView& view, const void* section) {
  return section == nullptr ? 0
                            : reinterpret_cast<std::uintptr_t>(section) - reinterpret_cast<std::uintptr_t>(view.base);
}

/// Whether the scene's memory begins with its header. A refit changes the bounds there, not in the view.
HIPRT_HD bool has_header(const SceneView& view) {
  if (view.root == kInvalidRef) return false;
  const auto& header = *reinterpret_cast<const FileHeader*>(view.base);
  for (unsigned i = 0; i < sizeof(kMagic); ++i)
    if (header.magic[i] != "HIPRTBVH"[i]) return false;
  return header.root == view.root;
}

/// @return the record of a scene, with its address as the offset.
HIPRT_HD ObjectRecord record_of(const SceneView& view) {
  ObjectRecord record{};
  record.offset = reinterpret_cast<std::uintptr_t>(view.base);
  record.size = view.size;
  record.geometries = offset_in(view, view.geometries);
  record.instances = offset_in(view, view.instances);
  record.motions = offset_in(view, view.motions);
  record.features = view.features;
  record.bounds = has_header(view) ? reinterpret_cast<const FileHeader*>(view.base)->bounds : view.bounds;
  record.root = view.root;
  record.condition = view.condition;
  record.reach = view.reach;
  record.stack_bound = view.stack_bound;
  record.levels = view.levels;
  record.reserved = static_cast<std::uint32_t>(view.layout);
  return record;
}

__global__ void put_objects(ObjectChunk chunk, std::uint32_t count, ObjectRecord* records) {
  const std::uint32_t i = thread_index();
  if (i >= count) return;
  const gpu::ObjectSource& source = chunk.sources[i];
  records[i] = record_of(source.view != nullptr ? *source.view : source.known);
}

__global__ void __launch_bounds__(kBlock)
    put_views(const SceneView* views, std::uint32_t count, ObjectRecord* records) {
  const std::uint32_t i = thread_index();
  if (i < count) records[i] = record_of(views[i]);
}

}  // namespace
}  // namespace hiprt::build::kernels

namespace hiprt::gpu {

using namespace build::kernels;

Result<void> enqueue_objects(std::span<const ObjectSource> sources, ObjectRecord* records, hipStream_t stream) {
  if (records == nullptr && !sources.empty())
    return fail(ErrorCode::kInvalidInput, "enqueue_objects: records at nullptr");
  Launcher steps(stream);
  for (std::size_t begin = 0; begin < sources.size(); begin += ObjectChunk::kSize) {
    const std::size_t count = std::min<std::size_t>(ObjectChunk::kSize, sources.size() - begin);
    ObjectChunk chunk{};
    std::copy_n(sources.begin() + static_cast<std::ptrdiff_t>(begin), count, chunk.sources);
    steps.blocks("put_objects", ObjectChunk::kSize, 1, put_objects, chunk, static_cast<std::uint32_t>(count),
                 records + begin);
  }
  return steps.result();
}

Result<void> enqueue_objects(const SceneView* views, std::uint32_t count, ObjectRecord* records, hipStream_t stream) {
  if (count == 0) return {};
  if (records == nullptr || views == nullptr)
    return fail(ErrorCode::kInvalidInput, "enqueue_objects: views and records must not be nullptr");
  Launcher steps(stream);
  steps.each(count, "put_views", put_views, views, count, records);
  return steps.result();
}

}  // namespace hiprt::gpu
