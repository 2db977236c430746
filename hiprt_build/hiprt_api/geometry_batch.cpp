#include <hiprt_build/hiprt_api/geometry_batch.h>

#include <hiprt_build/hiprt_api/kernels.h>

#include <algorithm>
#include <numeric>

namespace hiprt::api {
namespace {

/// The options of a batch, whatever the quality.
gpu::BuildOptions batch_options() { return {.builder = build::Builder::kHploc}; }

/// Descriptions are copied to the beginning of the scratch memory.
std::uint64_t description_bytes(std::size_t count) { return align_up(count * sizeof(gpu::DeviceGeometry)); }

Result<gpu::BuildSizes> sizes_of(std::span<const gpu::DeviceGeometry> geometries) {
  auto sizes = gpu::batch_sizes({geometries, geometries.data()}, batch_options());
  if (sizes) sizes->scratch += description_bytes(geometries.size());
  return sizes;
}

/// Whether a geometry is built together with others.
bool is_small(const hiprtGeometryBuildInput& input, const hiprtBuildOptions& options) {
  const std::uint32_t most = std::min(options.batchBuildMaxPrimCount, gpu::kBatchTriangles);
  return kind_of(options) != BuildKind::kImport && primitive_count(input) <= most;
}

/// Follows the geometries of a call through the batch of a pool.
class PoolWalk {
 public:
  PoolWalk(hiprtContextObject& context, BuildWork& work) : context_(context), work_(work) {}

  /// @return whether the geometry is the pool's next one; then it has been converted.
  Result<bool> take(hiprtGeometry geometry, const hiprtGeometryBuildInput& input) {
    if (pool_ == nullptr)
      if (auto begun = begin(geometry); !begun || !*begun) return begun;
    if (next_ == pool_->batched || geometry != pool_->header(next_)) return false;
    gpu::DeviceGeometry& description = *(reinterpret_cast<gpu::DeviceGeometry*>(work_.descriptions->data()) + next_);
    description = geometry_of(input);
    if (description.primitive_count != pool_->batch_counts[next_]) work_.has_other_counts = true;
    ++next_;
    return true;
  }

  /// Whether the whole batch was there.
  bool is_complete() const {
    if (pool_ == nullptr || next_ != pool_->batched) return false;
    const auto end = pool_->members.begin() + static_cast<std::ptrdiff_t>(next_);
    return pool_->alive == pool_->members.size() ||
           std::all_of(pool_->members.begin(), end, [](const Member& member) { return member.alive; });
  }

 private:
  Result<bool> begin(hiprtGeometry geometry) {
    const Found found = context_.geometries.find(geometry);
    if (!found || found.index != 0 || found.pool->batched == 0) return false;
    auto memory = context_.host_buffers.take(found.pool->batched * sizeof(gpu::DeviceGeometry));
    if (!memory) return tl::unexpected(std::move(memory.error()));
    work_.descriptions = std::move(*memory);
    work_.pool = found.pool;
    pool_ = found.pool.get();
    return true;
  }

  hiprtContextObject& context_;
  BuildWork& work_;
  const Pool* pool_ = nullptr;
  std::uint32_t next_ = 0;
};

}  // namespace

std::vector<std::uint32_t> small_inputs(GeometryInputs inputs, const hiprtBuildOptions& options) {
  std::vector<std::uint32_t> numbers;
  if (inputs.size() < 2) return numbers;
  for (std::uint32_t i = 0; i < inputs.size(); ++i)
    if (is_small(inputs[i], options)) numbers.push_back(i);
  if (numbers.size() < 2) numbers.clear();
  return numbers;
}

Result<gpu::BuildSizes> batch_sizes(GeometryInputs inputs, std::span<const std::uint32_t> numbers) {
  std::vector<gpu::DeviceGeometry> geometries;
  geometries.reserve(numbers.size());
  for (const std::uint32_t i : numbers) geometries.push_back(geometry_of(inputs[i]));
  return sizes_of(geometries);
}

Result<BuildWork> gather(hiprtContextObject& context, GeometryInputs inputs, const hiprtBuildOptions& options,
                         const hiprtGeometry* geometries) {
  BuildWork work;
  PoolWalk walk(context, work);
  bool batches = inputs.size() > 1;
  for (std::uint32_t i = 0; i < inputs.size(); ++i) {
    if (!is_valid(inputs[i], options)) {
      work.all_valid = false;
      return work;
    }
    if (batches && is_small(inputs[i], options)) {
      const auto taken = walk.take(geometries[i], inputs[i]);
      if (!taken) return tl::unexpected(taken.error());
      if (*taken) continue;
      batches = false;
    }
    work.others.push_back(i);
  }
  if (!batches || !walk.is_complete()) {
    if (work.descriptions) context.host_buffers.give_back(std::move(work.descriptions));
    work.pool = nullptr;
    work.others.resize(inputs.size());
    std::iota(work.others.begin(), work.others.end(), 0u);
  }
  return work;
}

Result<void> build_batch(hiprtContextObject& context, BuildWork& work, Scratch& temporary, hipStream_t stream) {
  Pool& pool = *work.pool;
  const std::span<const gpu::DeviceGeometry> geometries(
      reinterpret_cast<const gpu::DeviceGeometry*>(work.descriptions->data()), pool.batched);
  const auto sizes = work.has_other_counts ? sizes_of(geometries) : pool.batch_sizes;
  if (!sizes) return tl::unexpected(sizes.error());
  if (sizes->output > pool.batch_sizes.output)
    return gpu::fail(ErrorCode::kInvalidInput, "the batch has more primitives than when it was created");
  const auto scratch = temporary.of_size(sizes->scratch);
  if (!scratch) return tl::unexpected(scratch.error());
  auto done =
      gpu::check(hipMemcpyAsync(*scratch, geometries.data(), geometries.size_bytes(), hipMemcpyHostToDevice, stream),
                 "hipMemcpyAsync", geometries.size(), " descriptions of geometries");
  if (done) done = work.descriptions->record(stream);
  if (!done) return done;
  const auto scenes =
      gpu::enqueue_batch({geometries, reinterpret_cast<const gpu::DeviceGeometry*>(*scratch)}, batch_options(),
                         pool.batch_storage, *scratch + description_bytes(geometries.size()), stream);
  context.host_buffers.give_back(std::move(work.descriptions));
  if (!scenes) return tl::unexpected(scenes.error());
  pool.batch = *scenes;
  return enqueue_headers(scenes->views, pool.header(0), pool.batched, stream);
}

}  // namespace hiprt::api
