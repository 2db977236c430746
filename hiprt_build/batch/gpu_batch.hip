#include <hiprt_build/gpu/batch.h>

#include <hiprt_build/batch/gpu_batch_kernels.h>
#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/exec/gpu_scan.h>
#include <hiprt_build/pipeline/gpu_check_options.h>
#include <hiprt_build/pipeline/gpu_geometry.h>

#include <algorithm>

namespace hiprt::gpu {
namespace {

using namespace build::kernels;
using build::Builder;

/// Both kinds of batches.
class BatchInput {
 public:
  explicit BatchInput(const DeviceBatch& batch) : shared_(&batch) {}
  explicit BatchInput(const GeometryBatch& batch) : separate_(&batch) {}

  const DeviceBatch* shared() const { return shared_; }
  const GeometryBatch* separate() const { return separate_; }
  std::size_t size() const { return shared_ != nullptr ? shared_->first.size() - 1 : separate_->geometries.size(); }
  std::uint32_t primitives(std::size_t i) const {
    return shared_ != nullptr ? shared_->first[i + 1] - shared_->first[i] : separate_->geometries[i].primitive_count;
  }
  DeviceGeometry geometry(std::size_t i) const {
    if (separate_ != nullptr) return separate_->geometries[i];
    return {.positions = shared_->positions,
            .triangles = shared_->triangles + shared_->first[i],
            .position_count = shared_->position_count,
            .primitive_count = primitives(i)};
  }
  /// Whether some geometry has more than @p above primitives, up to @p most.
  bool has_sizes(std::int64_t above, std::int64_t most) const {
    for (std::size_t i = 0; i < size(); ++i)
      if (const std::int64_t count = primitives(i); count > above && count <= most) return true;
    return false;
  }

 private:
  const DeviceBatch* shared_ = nullptr;
  const GeometryBatch* separate_ = nullptr;
};

/// Offsets of a batch's results, and of its scratch memory.
struct BatchLayout {
  std::uint64_t records, report, counts, views, nodes, leaves, large, size;
  std::uint64_t first = 0, scan = 0, scratch = 0;
  std::size_t scan_bytes = 0;
  std::uint32_t primitives = 0;

  BatchLayout(const BatchInput& batch, std::uint32_t all) : primitives(all) {
    Arena arena, temporary;
    const auto take = [](Arena& from, std::uint64_t bytes) {
      from.take<std::byte>(0);
      const std::uint64_t at = from.size();
      from.take<std::byte>(bytes);
      return at;
    };
    const std::uint64_t count = batch.size();
    records = take(arena, (batch.separate() != nullptr ? count : 1) * sizeof(GeometryRecord));
    report = take(arena, sizeof(BatchReport));
    counts = take(arena, count * sizeof(BatchCounts));
    views = take(arena, count * sizeof(SceneView));
    nodes = take(arena, std::uint64_t{all} * sizeof(PlanesBoxNode));
    leaves = take(arena, std::uint64_t{all} * sizeof(PlanesLeaf));
    large = size = arena.size();
    if (batch.separate() == nullptr) return;
    const auto entries = static_cast<std::uint32_t>(count + 1);
    scan_bytes = build::scan_bytes(entries);
    first = take(temporary, entries * sizeof(std::uint32_t));
    scan = take(temporary, scan_bytes);
    scratch = temporary.size();
  }
};

Result<void> check_shared(const DeviceBatch& batch) {
  if (batch.first.empty() || batch.first[0] != 0)
    return fail(ErrorCode::kInvalidInput, "batch: first must begin with 0 and have one number more than meshes");
  for (std::size_t i = 0; i + 1 < batch.first.size(); ++i)
    if (batch.first[i] > batch.first[i + 1])
      return fail(ErrorCode::kInvalidInput, "batch: first[", i, "] is ", batch.first[i], ", first[", i + 1, "] only ",
                  batch.first[i + 1]);
  const bool arrays = batch.positions != nullptr && batch.triangles != nullptr && batch.device_first != nullptr;
  if (batch.first.back() != 0 && !arrays)
    return fail(ErrorCode::kInvalidInput, "batch: positions, triangles and device_first must not be nullptr");
  return {};
}

Result<void> check_separate(const GeometryBatch& batch) {
  if (batch.device_geometries == nullptr && !batch.geometries.empty())
    return fail(ErrorCode::kInvalidInput, "batch: device_geometries must not be nullptr");
  for (std::size_t i = 0; i < batch.geometries.size(); ++i)
    if (auto arrays = check_arrays(batch.geometries[i], i); !arrays) return arrays;
  return {};
}

Result<void> check_batch(const BatchInput& batch, const BuildOptions& options) {
  if (auto checked = check_options(options); !checked) return checked;
  if (options.builder != Builder::kLbvh && options.builder != Builder::kLbvh30 && options.builder != Builder::kHploc)
    return fail(ErrorCode::kInvalidInput, "batches are built by lbvh, lbvh30 and hploc, not by ",
                build::name(options.builder));
  if (options.presplit_budget > 1.0 || options.reinsertion_rounds.value_or(0) != 0)
    return fail(ErrorCode::kInvalidInput, "batches have neither cuts nor rounds of reinsertion");
  if (options.nodes != NodeLayout::kPlanes)
    return fail(ErrorCode::kInvalidInput, "batches are written in node layout planes only");
  if (auto arrays = batch.shared() != nullptr ? check_shared(*batch.shared()) : check_separate(*batch.separate());
      !arrays)
    return arrays;
  if (batch.size() > std::numeric_limits<std::int32_t>::max())
    return fail(ErrorCode::kTooLarge, batch.size(), " meshes, a grid has at most ",
                std::numeric_limits<std::int32_t>::max());
  return {};
}

Result<BatchLayout> plan_batch(const BatchInput& batch, const BuildOptions& options) {
  if (auto checked = check_batch(batch, options); !checked) return tl::unexpected(std::move(checked.error()));
  std::uint64_t primitives = 0;
  for (std::size_t i = 0; i < batch.size(); ++i) primitives += batch.primitives(i);
  const auto too_large = [&] {
    return fail(ErrorCode::kTooLarge, primitives, " primitives: their nodes and leaves may pass byte ", kAddressLimit,
                ", which a node reference addresses");
  };
  if (primitives > kAddressLimit / sizeof(PlanesLeaf)) return too_large();
  BatchLayout layout(batch, static_cast<std::uint32_t>(primitives));
  if (layout.leaves + primitives * sizeof(PlanesLeaf) > kAddressLimit) return too_large();
  std::uint64_t build = 0;
  for (std::size_t i = 0; i < batch.size(); ++i) {
    if (batch.primitives(i) <= kBatchTriangles) continue;
    const DeviceGeometry geometry = batch.geometry(i);
    const auto sizes = build_sizes({&geometry, 1}, options);
    if (!sizes) return tl::unexpected(sizes.error());
    layout.size += sizes->output;
    build = std::max(build, sizes->scratch);
  }
  // The builds come after the last use of the batch's own.
  layout.scratch = std::max({layout.scratch, build, std::uint64_t{kDeviceAlignment}});
  return layout;
}

template <unsigned kMost, unsigned kThreads>
Result<void> launch_batch(const BatchJob& job, const BatchInput& batch, int above, hipStream_t stream) {
  if (!batch.has_sizes(above, kMost)) return {};
  return launch(build_batch<kMost, kThreads>, Grid{static_cast<unsigned>(batch.size())}, stream,
                {.block = kThreads, .name = "build_batch"}, job, 0u, above);
}

BatchJob make_job(const BatchInput& batch, const BuildOptions& options, const BatchLayout& layout, std::byte* output,
                  std::byte* scratch) {
  const build::SahCosts& costs = options.costs;
  BatchJob job{};
  if (const DeviceBatch* shared = batch.shared()) {
    job.together = build::GeometryView::of_mesh(shared->positions, shared->position_count, sizeof(build::Position),
                                                shared->triangles, 0, sizeof(build::Triangle));
    job.first = shared->device_first;
  } else {
    job.geometries = batch.separate()->device_geometries;
    job.first = reinterpret_cast<const std::uint32_t*>(scratch + layout.first);
  }
  job.pair = options.pair_triangles && options.max_leaf_triangles > 1;
  job.hploc = options.builder == Builder::kHploc;
  job.radius = options.ploc_radius;
  job.costs = {costs.box_node, costs.leaf, costs.custom, options.max_leaf_triangles};
  job.base = output;
  job.nodes_offset = layout.nodes;
  job.leaves_offset = layout.leaves;
  job.records = reinterpret_cast<GeometryRecord*>(output + layout.records);
  job.views = reinterpret_cast<SceneView*>(output + layout.views);
  job.counts = reinterpret_cast<BatchCounts*>(output + layout.counts);
  job.report = reinterpret_cast<BatchReport*>(output + layout.report);
  job.size = layout.large;
  return job;
}

Result<BatchScenes> enqueue(const BatchInput& batch, const BuildOptions& options, std::byte* output, std::byte* scratch,
                            hipStream_t stream) {
  const auto layout = plan_batch(batch, options);
  if (!layout) return tl::unexpected(layout.error());
  const auto count = static_cast<std::uint32_t>(batch.size());
  const BatchJob job = make_job(batch, options, *layout, output, scratch);
  Launcher steps(stream);
  steps.one("start_batch", start_batch, BatchReport{}, job.report, job.records);
  if (batch.separate() != nullptr) {
    auto* first = reinterpret_cast<std::uint32_t*>(scratch + layout->first);
    steps.each(std::uint64_t{count} + 1, "count_primitives", count_primitives, job.geometries, count, first);
    std::size_t bytes = layout->scan_bytes;
    steps.then(
        [&] { return build::exclusive_scan(scratch + layout->scan, bytes, first, first, count + 1, nullptr, stream); });
  }
  steps.then([&] { return launch_batch<32, 32>(job, batch, -1, stream); });
  steps.then([&] { return launch_batch<kBatchTriangles, 128>(job, batch, 32, stream); });
  std::byte* next = output + layout->large;
  for (std::size_t i = 0; i < batch.size() && steps.result(); ++i) {
    if (batch.primitives(i) <= kBatchTriangles) continue;
    const DeviceGeometry geometry = batch.geometry(i);
    const auto report = enqueue_build({&geometry, 1}, options, next, scratch, stream);
    if (!report) return tl::unexpected(report.error());
    steps.one("adopt_scene", adopt_scene, *report, job.views + i, job.counts + i, job.report);
    next += build_sizes({&geometry, 1}, options)->output;
  }
  if (!steps.result()) return tl::unexpected(std::move(steps.result().error()));
  return BatchScenes{job.views, job.report, job.counts, count};
}

Result<BuildSizes> sizes_of(const BatchInput& batch, const BuildOptions& options) {
  const auto layout = plan_batch(batch, options);
  if (!layout) return tl::unexpected(layout.error());
  return BuildSizes{layout->size, layout->scratch};
}

}  // namespace

Result<BuildSizes> batch_sizes(const DeviceBatch& batch, const BuildOptions& options) {
  return sizes_of(BatchInput(batch), options);
}
Result<BuildSizes> batch_sizes(const GeometryBatch& batch, const BuildOptions& options) {
  return sizes_of(BatchInput(batch), options);
}

Result<BatchScenes> enqueue_batch(const DeviceBatch& batch, const BuildOptions& options, std::byte* output,
                                  std::byte* scratch, hipStream_t stream) {
  return enqueue(BatchInput(batch), options, output, scratch, stream);
}
Result<BatchScenes> enqueue_batch(const GeometryBatch& batch, const BuildOptions& options, std::byte* output,
                                  std::byte* scratch, hipStream_t stream) {
  return enqueue(BatchInput(batch), options, output, scratch, stream);
}

}  // namespace hiprt::gpu
