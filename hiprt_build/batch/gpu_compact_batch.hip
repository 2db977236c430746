#include <hiprt_build/gpu/batch.h>

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/exec/gpu_scan.h>
#include <hiprt_build/format/node_places.h>
#include <hiprt_build/pipeline/gpu_state.h>

#include <algorithm>
#include <array>

namespace hiprt::build::kernels {
namespace {

constexpr unsigned kCopyBlock = 64;

/// Numbers of nodes, and 0 at the end; then those of leaves.
__global__ void __launch_bounds__(kBlock)
    split_counts(const gpu::BatchCounts* counts, std::uint32_t count, std::uint32_t* nodes, std::uint32_t* leaves) {
  const std::uint32_t i = thread_index();
  if (i > count) return;
  nodes[i] = i < count ? counts[i].nodes : 0;
  leaves[i] = i < count ? counts[i].leaves : 0;
}

/// Where the copies of scenes are.
struct CompactJob {
  gpu::BatchScenes from;
  const std::uint32_t *first_node, *first_leaf;  ///< Of each scene.
  std::byte* base;
  std::uint64_t size, records, views, counts, nodes, leaves;  ///< Bytes; offsets.
};

/// Offset of a tree's first leaf record. The records lie together.
__device__ std::uint64_t lowest_leaf(const SceneView& view, const NodeArray<const PlanesBoxNode>& nodes,
                                     std::uint32_t count) {
  if (!is_box(view.root)) return ref_offset(view.root);
  std::uint64_t lowest = ~std::uint64_t{0};
  for (std::uint32_t i = 0; i < count; ++i)
    for (const NodeRef child : nodes[i].child)
      if (child != kInvalidRef && !is_box(child) && ref_offset(child) < lowest) lowest = ref_offset(child);
  return lowest;
}

/// Block i copies scene i.
__global__ void __launch_bounds__(kCopyBlock) copy_scenes(CompactJob job) {
  __shared__ std::uint64_t leaf_at;
  const std::uint32_t i = blockIdx.x;
  const SceneView& from = job.from.views[i];
  const gpu::BatchCounts counts = job.from.counts[i];
  const std::uint64_t node_at = counts.nodes == 0 ? 0 : ref_offset(from.root);
  const NodePlaces places(sizeof(PlanesBoxNode), counts.gaps != 0), packed(sizeof(PlanesBoxNode), false);
  const NodeArray<const PlanesBoxNode> nodes(from.base + node_at, places);
  if (threadIdx.x == 0) leaf_at = counts.leaves == 0 ? 0 : lowest_leaf(from, nodes, counts.nodes);
  __syncthreads();
  const std::uint64_t new_node = job.nodes + packed.offset(job.first_node[i]),
                      new_leaf = job.leaves + std::uint64_t{job.first_leaf[i]} * sizeof(PlanesLeaf);
  const auto moved = [&](NodeRef ref) {
    if (ref == kInvalidRef) return ref;
    const std::uint64_t offset = is_box(ref) ? new_node + packed.offset(places.number(ref_offset(ref) - node_at))
                                             : ref_offset(ref) - leaf_at + new_leaf;
    return make_ref(offset, ref_type(ref));
  };
  const NodeArray<PlanesBoxNode> to(job.base + new_node, packed);
  const auto* leaves = reinterpret_cast<const PlanesLeaf*>(from.base + leaf_at);
  for (std::uint32_t k = threadIdx.x; k < counts.nodes; k += kCopyBlock) {
    PlanesBoxNode node = nodes[k];
    for (NodeRef& child : node.child) child = moved(child);
    to[k] = node;
  }
  for (std::uint32_t k = threadIdx.x; k < counts.leaves; k += kCopyBlock)
    reinterpret_cast<PlanesLeaf*>(job.base + new_leaf)[k] = leaves[k];
  if (threadIdx.x != 0) return;
  auto* record = reinterpret_cast<GeometryRecord*>(job.base + job.records) + i;
  *record = from.geometries != nullptr ? *from.geometries : GeometryRecord{0, 0, 0, 0xffffffffu, 0};
  SceneView view = from;
  view.base = job.base;
  view.size = job.size;
  view.geometries = record;
  view.root = moved(from.root);
  reinterpret_cast<SceneView*>(job.base + job.views)[i] = view;
  reinterpret_cast<gpu::BatchCounts*>(job.base + job.counts)[i] = {counts.nodes, counts.leaves};
}

}  // namespace
}  // namespace hiprt::build::kernels

namespace hiprt::gpu {

using namespace build::kernels;

Result<CompactBatch> compact_batch(const BatchScenes& scenes, hipStream_t stream, Allocator& allocator) {
  const std::uint64_t entries = std::uint64_t{scenes.count} + 1;
  std::size_t scan_bytes = build::scan_bytes(static_cast<std::uint32_t>(entries));
  Arena sizes;
  sizes.take<std::uint32_t>(entries);
  sizes.take<std::uint32_t>(entries);
  sizes.take<std::byte>(scan_bytes);
  auto scratch = DeviceBuffer::make(static_cast<std::size_t>(sizes.size()), stream, allocator);
  if (!scratch) return tl::unexpected(std::move(scratch.error()));
  Arena arena(scratch->data());
  auto* const first_node = arena.take<std::uint32_t>(entries);
  auto* const first_leaf = arena.take<std::uint32_t>(entries);
  auto* const scan = arena.take<std::byte>(scan_bytes);
  Launcher steps(stream);
  steps.each(entries, "split_counts", split_counts, scenes.counts, scenes.count, first_node, first_leaf);
  std::array<std::uint32_t, 2> totals{};
  unsigned k = 0;
  for (std::uint32_t* sums : {first_node, first_leaf}) {
    steps.then([&] {
      return build::exclusive_scan(scan, scan_bytes, sums, sums, static_cast<std::uint32_t>(entries), nullptr, stream);
    });
    steps.then([&] {
      return check(
          hipMemcpyAsync(&totals[k], sums + scenes.count, sizeof(std::uint32_t), hipMemcpyDeviceToHost, stream),
          "hipMemcpyAsync", "numbers of nodes and leaves");
    });
    ++k;
  }
  steps.then([&] { return check(hipStreamSynchronize(stream), "hipStreamSynchronize"); });
  if (!steps.result()) return tl::unexpected(std::move(steps.result().error()));
  CompactJob job{scenes, first_node, first_leaf, nullptr, 0, 0, 0, 0, 0, 0};
  // Behind at least one byte, so that no record is at offset 0.
  job.records = kDeviceAlignment;
  job.views = align_up(job.records + scenes.count * sizeof(GeometryRecord), kDeviceAlignment);
  job.counts = align_up(job.views + scenes.count * sizeof(SceneView), kDeviceAlignment);
  const std::uint64_t report = align_up(job.counts + scenes.count * sizeof(BatchCounts), kDeviceAlignment);
  job.nodes = align_up(report + sizeof(BatchReport), kDeviceAlignment);
  job.leaves = align_up(job.nodes + std::uint64_t{totals[0]} * sizeof(PlanesBoxNode), kDeviceAlignment);
  job.size = job.leaves + std::uint64_t{totals[1]} * sizeof(PlanesLeaf);
  if (job.size > kAddressLimit)
    return fail(ErrorCode::kTooLarge, "compact_batch: ", job.size, " bytes, a node reference addresses ",
                kAddressLimit);
  auto buffer = DeviceBuffer::make(static_cast<std::size_t>(job.size), stream, allocator);
  if (!buffer) return tl::unexpected(std::move(buffer.error()));
  job.base = buffer->data();
  const auto copy = [&](std::uint64_t to, const void* from, std::uint64_t bytes) {
    steps.then([&] {
      return check(
          hipMemcpyAsync(job.base + to, from, static_cast<std::size_t>(bytes), hipMemcpyDeviceToDevice, stream),
          "hipMemcpyAsync", bytes, " bytes");
    });
  };
  copy(report, scenes.report, sizeof(BatchReport));
  if (scenes.count != 0) {
    steps.blocks("copy_scenes", kCopyBlock, scenes.count, copy_scenes, job);
  }
  if (!steps.result()) return tl::unexpected(std::move(steps.result().error()));
  const BatchScenes made{reinterpret_cast<const SceneView*>(job.base + job.views),
                         reinterpret_cast<const BatchReport*>(job.base + report),
                         reinterpret_cast<const BatchCounts*>(job.base + job.counts), scenes.count};
  return CompactBatch{std::move(*buffer), made};
}

}  // namespace hiprt::gpu
