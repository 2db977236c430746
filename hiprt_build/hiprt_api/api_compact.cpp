// Compaction of geometries.

#include <hiprt_build/hiprt_api/context.h>
#include <hiprt_build/hiprt_api/kernels.h>

#include <algorithm>

using namespace hiprt;
using api::Found;
using api::Result;

namespace {

/// A geometry that was built alone.
Result<std::shared_ptr<api::Pool>> compact_one(const Found& from, hipStream_t stream) {
  api::HeadroomAllocator allocator(api::kHeadroom);
  const auto scene = gpu::compact(from.member().report, stream, allocator);
  if (!scene) return tl::unexpected(scene.error());
  return api::pool_of_one(allocator, scene->buffer.data(), scene->report, stream);
}

/// Geometries of a batch: @p count from number @p first on.
Result<std::shared_ptr<api::Pool>> compact_batch(const api::Pool& from, std::size_t first, std::uint32_t count,
                                                 hipStream_t stream) {
  const std::uint64_t headroom = count * sizeof(api::ObjectHeader);
  api::HeadroomAllocator allocator(headroom);
  const gpu::BatchScenes scenes{from.batch.views + first, from.batch.report, from.batch.counts + first, count};
  const auto batch = gpu::compact_batch(scenes, stream, allocator);
  if (!batch) return tl::unexpected(batch.error());
  auto pool = std::make_shared<api::Pool>();
  pool->memory = allocator.adopt(batch->buffer.data());
  pool->members.resize(count);
  pool->batch = batch->scenes;
  pool->compact = true;
  for (api::Member& member : pool->members) member.built = true;
  auto done = api::enqueue_headers(batch->scenes.views, pool->header(0), count, stream);
  // Destroyed inputs are read until the stream has passed the copies.
  if (done) done = gpu::check(hipStreamSynchronize(stream), "hipStreamSynchronize");
  if (!done) return tl::unexpected(std::move(done.error()));
  return pool;
}

/// How many geometries from number @p i on are neighbours in a batch.
std::uint32_t run_length(const api::ObjectTable& table, const hiprtGeometry* geometries, std::uint32_t i,
                         std::uint32_t count) {
  const Found first = table.find(geometries[i]);
  std::uint32_t length = 1;
  while (i + length < count && first.index + length < first.pool->batched &&
         geometries[i + length] == first.pool->header(first.index + length))
    ++length;
  return length;
}

Result<void> compact(hiprtContextObject& context, std::uint32_t count, hipStream_t stream, hiprtGeometry* ins,
                     hiprtGeometry** outs) {
  const std::vector<hiprtGeometry> geometries(ins, ins + count);
  for (std::uint32_t i = 0; i < count;) {
    const Found from = context.geometries.find(geometries[i]);
    if (!from || !from.is_built())
      return gpu::fail(build::ErrorCode::kInvalidInput, "geometry ", i, " is none of this context, or was not built");
    // Compact geometries of a batch are compact already.
    if (from.member().report == nullptr && from.pool->compact) {
      *outs[i] = geometries[i];
      ++i;
      continue;
    }
    const bool alone = from.member().report != nullptr;
    const std::uint32_t length = alone ? 1 : run_length(context.geometries, geometries.data(), i, count);
    auto made = alone ? compact_one(from, stream) : compact_batch(*from.pool, from.index, length, stream);
    if (!made) return tl::unexpected(made.error());
    for (std::uint32_t k = 0; k < length; ++k) {
      static_cast<void>(context.geometries.remove(geometries[i + k]));
      *outs[i + k] = (*made)->header(k);
    }
    context.geometries.add(std::move(*made));
    i += length;
  }
  return {};
}

template <class Pointer> bool all_there(Pointer* pointers, std::uint32_t count) {
  return pointers != nullptr && std::none_of(pointers, pointers + count, [](auto p) { return p == nullptr; });
}

}  // namespace

hiprtError hiprtCompactGeometry(hiprtContext context, hiprtApiStream stream, hiprtGeometry in, hiprtGeometry& out) {
  hiprtGeometry* address = &out;
  return hiprtCompactGeometries(context, 1, stream, &in, &address);
}

hiprtError hiprtCompactGeometries(hiprtContext context, uint32_t count, hiprtApiStream stream, hiprtGeometry* ins,
                                  hiprtGeometry** outs) {
  if (context == nullptr || count == 0 || !all_there(ins, count) || !all_there(outs, count))
    return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtCompactGeometries",
                  [&] { return compact(*context, count, static_cast<hipStream_t>(stream), ins, outs); });
}
