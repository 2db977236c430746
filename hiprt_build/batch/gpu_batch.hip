#include <hiprt_build/gpu/batch.h>

#include <hiprt_build/batch/gpu_batch_kernels.h>
#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/gpu/launch.h>
#include <hiprt_build/pipeline/gpu_check_options.h>

#include <algorithm>

namespace hiprt::gpu {
namespace {

using namespace build::kernels;
using build::Builder;

/// Offsets of a batch's results.
struct BatchLayout {
  std::uint64_t record, report, views, nodes, leaves, large, size;
  std::uint64_t scratch = 0;
  std::uint32_t triangles = 0, smallest = 0, largest = 0;

  BatchLayout(const DeviceBatch& batch, std::size_t meshes) {
    triangles = batch.first.back();
    Arena arena;
    const auto take = [&](std::uint64_t bytes) {
      const std::uint64_t at = arena.size();
      arena.take<std::byte>(bytes);
      return at;
    };
    record = take(sizeof(GeometryRecord));
    report = take(sizeof(BatchReport));
    views = take(meshes * sizeof(SceneView));
    nodes = take(std::uint64_t{triangles} * sizeof(PlanesBoxNode));
    leaves = take(std::uint64_t{triangles} * sizeof(PlanesLeaf));
    large = size = arena.size();
  }
};

DeviceGeometry batch_geometry(const DeviceBatch& batch, std::size_t mesh) {
  return {.positions = batch.positions,
          .triangles = batch.triangles + batch.first[mesh],
          .position_count = batch.position_count,
          .primitive_count = batch.first[mesh + 1] - batch.first[mesh]};
}

Result<void> check_batch(const DeviceBatch& batch, const BuildOptions& options) {
  if (auto checked = check_options(options); !checked) return checked;
  if (options.builder != Builder::kLbvh && options.builder != Builder::kLbvh30 && options.builder != Builder::kHploc)
    return fail(ErrorCode::kInvalidInput, "batches are built by lbvh, lbvh30 and hploc, not by ",
                build::name(options.builder));
  if (options.presplit_budget > 1.0 || options.reinsertion_rounds.value_or(0) != 0)
    return fail(ErrorCode::kInvalidInput, "batches have neither cuts nor rounds of reinsertion");
  if (options.nodes != NodeLayout::kPlanes)
    return fail(ErrorCode::kInvalidInput, "batches are written in node layout planes only");
  if (batch.first.empty() || batch.first[0] != 0)
    return fail(ErrorCode::kInvalidInput, "batch: first must begin with 0 and have one number more than meshes");
  for (std::size_t i = 0; i + 1 < batch.first.size(); ++i)
    if (batch.first[i] > batch.first[i + 1])
      return fail(ErrorCode::kInvalidInput, "batch: first[", i, "] is ", batch.first[i], ", first[", i + 1, "] only ",
                  batch.first[i + 1]);
  if (batch.first.size() - 1 > std::numeric_limits<std::int32_t>::max())
    return fail(ErrorCode::kTooLarge, batch.first.size() - 1, " meshes, a grid has at most ",
                std::numeric_limits<std::int32_t>::max());
  const bool arrays = batch.positions != nullptr && batch.triangles != nullptr && batch.device_first != nullptr;
  if (batch.first.back() != 0 && !arrays)
    return fail(ErrorCode::kInvalidInput, "batch: positions, triangles and device_first must not be nullptr");
  return {};
}

Result<BatchLayout> plan_batch(const DeviceBatch& batch, const BuildOptions& options) {
  if (auto checked = check_batch(batch, options); !checked) return tl::unexpected(std::move(checked.error()));
  const std::size_t meshes = batch.first.size() - 1;
  BatchLayout layout(batch, meshes);
  if (layout.leaves + std::uint64_t{layout.triangles} * sizeof(PlanesLeaf) > kAddressLimit)
    return fail(ErrorCode::kTooLarge, layout.triangles, " triangles: their nodes and leaves may pass byte ",
                kAddressLimit, ", which a node reference addresses");
  for (std::size_t i = 0; i < meshes; ++i) {
    const DeviceGeometry geometry = batch_geometry(batch, i);
    if (geometry.primitive_count <= kBatchTriangles) continue;
    const auto sizes = build_sizes({&geometry, 1}, options);
    if (!sizes) return tl::unexpected(sizes.error());
    layout.size += sizes->output;
    layout.scratch = std::max(layout.scratch, sizes->scratch);
  }
  return layout;
}

/// Whether some mesh has more than @p above triangles, up to @p most.
bool has_sizes(std::span<const std::uint32_t> first, std::int64_t above, std::int64_t most) {
  for (std::size_t i = 0; i + 1 < first.size(); ++i) {
    const std::int64_t count = std::int64_t{first[i + 1]} - first[i];
    if (count > above && count <= most) return true;
  }
  return false;
}

template <unsigned kMost, unsigned kThreads>
Result<void> launch_batch(const BatchJob& job, std::span<const std::uint32_t> first, int above, hipStream_t stream) {
  if (!has_sizes(first, above, kMost)) return {};
  return launch(build_batch<kMost, kThreads>, Grid{static_cast<unsigned>(first.size() - 1)}, stream,
                {.block = kThreads, .name = "build_batch"}, job, 0u, above);
}

}  // namespace

Result<BuildSizes> batch_sizes(const DeviceBatch& batch, const BuildOptions& options) {
  const auto layout = plan_batch(batch, options);
  if (!layout) return tl::unexpected(layout.error());
  return BuildSizes{layout->size, std::max<std::uint64_t>(layout->scratch, kDeviceAlignment)};
}

Result<BatchScenes> enqueue_batch(const DeviceBatch& batch, const BuildOptions& options, std::byte* output,
                                  std::byte* scratch, hipStream_t stream) {
  const auto layout = plan_batch(batch, options);
  if (!layout) return tl::unexpected(layout.error());
  const build::SahCosts& costs = options.costs;
  const BatchJob job{batch.positions,
                     batch.triangles,
                     batch.position_count,
                     batch.device_first,
                     options.pair_triangles && options.max_leaf_triangles > 1,
                     options.builder == Builder::kHploc,
                     options.ploc_radius,
                     {costs.box_node, costs.leaf, costs.custom, options.max_leaf_triangles},
                     output,
                     layout->nodes,
                     layout->leaves,
                     reinterpret_cast<const GeometryRecord*>(output + layout->record),
                     reinterpret_cast<SceneView*>(output + layout->views),
                     reinterpret_cast<BatchReport*>(output + layout->report)};
  auto done = launch(start_batch, Grid{}, stream, {.block = 1, .name = "start_batch"}, BatchReport{}, job.report,
                     reinterpret_cast<GeometryRecord*>(output + layout->record));
  if (done) done = launch_batch<32, 32>(job, batch.first, -1, stream);
  if (done) done = launch_batch<kBatchTriangles, 128>(job, batch.first, 32, stream);
  std::byte* next = output + layout->large;
  for (std::size_t i = 0; i + 1 < batch.first.size() && done; ++i) {
    const DeviceGeometry geometry = batch_geometry(batch, i);
    if (geometry.primitive_count <= kBatchTriangles) continue;
    const auto report = enqueue_build({&geometry, 1}, options, next, scratch, stream);
    if (!report) return tl::unexpected(report.error());
    done = launch(adopt_scene, Grid{}, stream, {.block = 1, .name = "adopt_scene"}, *report, job.views + i, job.report);
    next += build_sizes({&geometry, 1}, options)->output;
  }
  if (!done) return tl::unexpected(std::move(done.error()));
  return BatchScenes{job.views, job.report};
}

}  // namespace hiprt::gpu
