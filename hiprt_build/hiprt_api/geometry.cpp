#include <hiprt_build/hiprt_api/geometry.h>

#include <hiprt_build/gpu/refit.h>
#include <hiprt_build/hiprt_api/geometry_batch.h>
#include <hiprt_build/hiprt_api/kernels.h>

#include <algorithm>

namespace hiprt::api {
namespace {

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
    const auto sizes = batch_sizes(inputs, small);
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
    const auto sizes = batch_sizes(inputs, small);
    if (!sizes) return tl::unexpected(sizes.error());
    pool->batch_sizes = *sizes;
    pool->batch_counts.reserve(small.size());
    for (const std::uint32_t i : small) pool->batch_counts.push_back(primitive_count(inputs[i]));
  }
  const std::uint64_t batch_at = bytes;
  bytes += align_up(pool->batch_sizes.output);
  // Members of the batch come first.
  std::vector<std::uint32_t> order = small;
  order.reserve(inputs.size());
  for (const std::uint32_t i : numbers_without(small, inputs.size())) {
    const auto sizes = geometry_sizes(inputs[i], options);
    if (!sizes) return tl::unexpected(sizes.error());
    pool->members[order.size()].capacity = align_up(sizes->output);
    bytes += align_up(sizes->output);
    order.push_back(i);
  }
  auto memory = Allocation::make(bytes);
  if (!memory) return tl::unexpected(std::move(memory.error()));
  pool->memory = std::move(*memory);
  pool->batch_storage = pool->memory.data() + batch_at;
  std::byte* at = pool->batch_storage + align_up(pool->batch_sizes.output);
  for (std::size_t i = small.size(); i < order.size(); ++i) {
    pool->members[i].storage = at;
    at += pool->members[i].capacity;
  }
  for (std::size_t i = 0; i < order.size(); ++i) *outs[order[i]] = pool->header(i);
  context->geometries.add(std::move(pool));
  return {};
}

Result<bool> build_geometries(hiprtContext context, hiprtBuildOperation operation, GeometryInputs inputs,
                              const hiprtBuildOptions& options, void* temporary, hipStream_t stream,
                              const hiprtGeometry* geometries) {
  auto work = gather(*context, inputs, options, geometries);
  if (!work) return tl::unexpected(std::move(work.error()));
  if (!work->all_valid) return false;
  if (operation != hiprtBuildOperationBuild && operation != hiprtBuildOperationUpdate) return true;
  Scratch scratch(temporary, stream);
  if (work->pool)
    if (auto built = build_batch(*context, *work, scratch, stream); !built) return tl::unexpected(built.error());
  for (const std::uint32_t i : work->others) {
    const Found found = context->geometries.find(geometries[i]);
    if (!found) return gpu::fail(ErrorCode::kInvalidInput, "geometry ", i, " is none of this context");
    if (auto built = build_one(operation, inputs[i], options, scratch, stream, found); !built)
      return tl::unexpected(built.error());
  }
  return true;
}

}  // namespace hiprt::api
