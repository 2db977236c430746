#include <hiprt_build/hiprt_api/geometry.h>

#include <hiprt_build/gpu/refit.h>
#include <hiprt_build/hiprt_api/kernels.h>

#include <algorithm>

namespace hiprt::api {
namespace {

std::uint64_t align(std::uint64_t bytes) { return (bytes + kAlignment - 1) / kAlignment * kAlignment; }

/// The geometries of a batch. Their descriptions are copied to the beginning of the scratch memory.
class Batch {
 public:
  Batch(GeometryInputs inputs, std::span<const std::uint32_t> numbers) {
    geometries_.reserve(numbers.size());
    for (const std::uint32_t i : numbers) geometries_.push_back(geometry_of(inputs[i]));
    // One by one they may have pairs; batches ignore them.
  }

  Result<gpu::BuildSizes> sizes() const {
    auto sizes = gpu::batch_sizes({geometries_, geometries_.data()}, batch_options());
    if (sizes) sizes->scratch += description_bytes();
    return sizes;
  }

  /// Sizes depend on nothing else.
  bool has_counts(std::span<const std::uint32_t> counts) const {
    return std::equal(
        geometries_.begin(), geometries_.end(), counts.begin(), counts.end(),
        [](const gpu::DeviceGeometry& geometry, std::uint32_t n) { return geometry.primitive_count == n; });
  }

  Result<gpu::BatchScenes> enqueue(std::byte* output, std::byte* scratch, hipStream_t stream) const {
    // The memory is pageable: the copy has been read when the call returns.
    auto copied = gpu::check(hipMemcpyAsync(scratch, geometries_.data(), geometries_.size() * sizeof(geometries_[0]),
                                            hipMemcpyHostToDevice, stream),
                             "hipMemcpyAsync", geometries_.size(), " descriptions of geometries");
    if (!copied) return tl::unexpected(std::move(copied.error()));
    return gpu::enqueue_batch({geometries_, reinterpret_cast<const gpu::DeviceGeometry*>(scratch)}, batch_options(),
                              output, scratch + description_bytes(), stream);
  }

 private:
  std::uint64_t description_bytes() const { return align(geometries_.size() * sizeof(gpu::DeviceGeometry)); }

  std::vector<gpu::DeviceGeometry> geometries_;
};

/// Builds a geometry alone.
Result<void> build_one(hiprtBuildOperation operation, const hiprtGeometryBuildInput& input,
                       const hiprtBuildOptions& options, Scratch& temporary, hipStream_t stream, const Found& found) {
  const auto sizes = geometry_sizes(input, options);
  if (!sizes) return tl::unexpected(sizes.error());
  const auto scratch = temporary.of_size(sizes->scratch);
  if (!scratch) return tl::unexpected(scratch.error());
  const gpu::DeviceGeometry geometry = geometry_of(input);
  Member& member = found.member();
  if (operation == hiprtBuildOperationUpdate && member.built && member.report != nullptr) {
    const auto moved = refit_geometry(found, geometry, *scratch, stream);
    if (!moved) return tl::unexpected(moved.error());
    if (*moved) return {};
  }
  if (auto room = found.pool->reserve(found.index, sizes->output); !room) return room;
  const gpu::BuildOptions how = options_of(options);
  const auto report = imports(input, options)
                          ? gpu::enqueue_import(geometry, tree_of(input), how, member.storage, *scratch, stream)
                          : gpu::enqueue_build({&geometry, 1}, how, member.storage, *scratch, stream);
  if (!report) return tl::unexpected(report.error());
  member.report = *report;
  member.parts.reset();
  member.built = true;
  return enqueue_headers(&(*report)->view, found.header(), 1, stream);
}

/// @return the pool whose batch these geometries are, whole and in order; or nullptr.
std::shared_ptr<Pool> pool_of(const hiprtContextObject& context, std::span<const std::uint32_t> numbers,
                              const hiprtGeometry* geometries) {
  if (numbers.empty()) return nullptr;
  const Found first = context.geometries.find(geometries[numbers[0]]);
  if (!first || first.index != 0 || first.pool->batched != numbers.size()) return nullptr;
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (geometries[numbers[i]] != first.pool->header(i) || !first.pool->members[i].alive) return nullptr;
  return first.pool;
}

Result<void> build_batch(Pool& pool, const Batch& batch, Scratch& temporary, hipStream_t stream) {
  const auto sizes = batch.has_counts(pool.batch_counts) ? pool.batch_sizes : batch.sizes();
  if (!sizes) return tl::unexpected(sizes.error());
  if (sizes->output > pool.batch_sizes.output)
    return gpu::fail(ErrorCode::kInvalidInput, "the batch has more primitives than when it was created");
  const auto scratch = temporary.of_size(sizes->scratch);
  if (!scratch) return tl::unexpected(scratch.error());
  const auto scenes = batch.enqueue(pool.batch_storage, *scratch, stream);
  if (!scenes) return tl::unexpected(scenes.error());
  pool.batch = *scenes;
  for (std::uint32_t i = 0; i < pool.batched; ++i) pool.members[i].built = true;
  return enqueue_headers(scenes->views, pool.header(0), pool.batched, stream);
}

/// The numbers below @p count that are not in @p left_out, which is sorted.
std::vector<std::uint32_t> numbers_without(std::span<const std::uint32_t> left_out, std::size_t count) {
  std::vector<std::uint32_t> numbers;
  numbers.reserve(count - left_out.size());
  auto next = left_out.begin();
  for (std::uint32_t i = 0; i < count; ++i) {
    if (next != left_out.end() && *next == i)
      ++next;
    else
      numbers.push_back(i);
  }
  return numbers;
}

}  // namespace

std::vector<std::uint32_t> small_inputs(GeometryInputs inputs, const hiprtBuildOptions& options) {
  std::vector<std::uint32_t> numbers;
  if (inputs.size() < 2) return numbers;
  for (std::uint32_t i = 0; i < inputs.size(); ++i)
    if (is_small(inputs[i], options)) numbers.push_back(i);
  if (numbers.size() < 2) numbers.clear();
  return numbers;
}

Result<gpu::BuildSizes> geometry_sizes(const hiprtGeometryBuildInput& input, const hiprtBuildOptions& options) {
  const gpu::DeviceGeometry geometry = geometry_of(input);
  const gpu::BuildOptions how = options_of(options);
  auto sizes = imports(input, options) ? gpu::import_sizes(geometry, tree_of(input), how)
                                       : gpu::build_sizes({&geometry, 1}, how);
  if (!sizes) return sizes;
  gpu::SceneParts most;
  most.geometry_count = 1;
  most.nodes = sizes->output / sizeof(PlanesBoxNode);
  sizes->scratch = std::max(sizes->scratch, gpu::refit_scratch(most));
  return sizes;
}

Result<std::uint64_t> temporary_size(GeometryInputs inputs, const hiprtBuildOptions& options) {
  const auto small = small_inputs(inputs, options);
  std::uint64_t most = 0;
  if (!small.empty()) {
    const auto sizes = Batch(inputs, small).sizes();
    if (!sizes) return tl::unexpected(sizes.error());
    most = sizes->scratch;
  }
  for (const std::uint32_t i : numbers_without(small, inputs.size())) {
    const auto sizes = geometry_sizes(inputs[i], options);
    if (!sizes) return tl::unexpected(sizes.error());
    most = std::max(most, sizes->scratch);
  }
  // The caller's buffer may be aligned to less.
  return most + kAlignment;
}

Result<void> create_geometries(hiprtContext context, GeometryInputs inputs, const hiprtBuildOptions& options,
                               hiprtGeometry* const* outs) {
  const auto small = small_inputs(inputs, options);
  auto pool = std::make_shared<Pool>();
  pool->members.resize(inputs.size());
  pool->batched = static_cast<std::uint32_t>(small.size());
  std::uint64_t bytes = inputs.size() * sizeof(ObjectHeader);
  if (!small.empty()) {
    const auto sizes = Batch(inputs, small).sizes();
    if (!sizes) return tl::unexpected(sizes.error());
    pool->batch_sizes = *sizes;
    pool->batch_counts.reserve(small.size());
    for (const std::uint32_t i : small) pool->batch_counts.push_back(primitive_count(inputs[i]));
  }
  const std::uint64_t batch_at = bytes;
  bytes += align(pool->batch_sizes.output);
  // Members of the batch come first.
  std::vector<std::uint32_t> order = small;
  order.reserve(inputs.size());
  for (const std::uint32_t i : numbers_without(small, inputs.size())) {
    const auto sizes = geometry_sizes(inputs[i], options);
    if (!sizes) return tl::unexpected(sizes.error());
    pool->members[order.size()].capacity = align(sizes->output);
    bytes += align(sizes->output);
    order.push_back(i);
  }
  auto memory = Allocation::make(bytes);
  if (!memory) return tl::unexpected(std::move(memory.error()));
  pool->memory = std::move(*memory);
  pool->batch_storage = pool->memory.data() + batch_at;
  std::byte* at = pool->batch_storage + align(pool->batch_sizes.output);
  for (std::size_t i = small.size(); i < order.size(); ++i) {
    pool->members[i].storage = at;
    at += pool->members[i].capacity;
  }
  for (std::size_t i = 0; i < order.size(); ++i) *outs[order[i]] = pool->header(i);
  context->geometries.add(std::move(pool));
  return {};
}

Result<void> build_geometries(hiprtContext context, hiprtBuildOperation operation, GeometryInputs inputs,
                              const hiprtBuildOptions& options, void* temporary, hipStream_t stream,
                              const hiprtGeometry* geometries) {
  if (operation != hiprtBuildOperationBuild && operation != hiprtBuildOperationUpdate) return {};
  Scratch scratch(temporary, stream);
  auto small = small_inputs(inputs, options);
  if (const auto pool = pool_of(*context, small, geometries)) {
    if (auto built = build_batch(*pool, Batch(inputs, small), scratch, stream); !built) return built;
  } else {
    small.clear();
  }
  for (const std::uint32_t i : numbers_without(small, inputs.size())) {
    const Found found = context->geometries.find(geometries[i]);
    if (!found) return gpu::fail(ErrorCode::kInvalidInput, "geometry ", i, " is none of this context");
    if (auto built = build_one(operation, inputs[i], options, scratch, stream, found); !built) return built;
  }
  return {};
}

}  // namespace hiprt::api
