#include <tools/render/studio/render_batches.h>

#include <algorithm>
#include <vector>

namespace hiprt::tools {
namespace {

/// Rays; below it a launch and its copies take longer than a CPU.
constexpr std::size_t kSmallBatch = 4096;

class Batches {
 public:
  Batches(GpuTracer& gpu, const RenderJob& job, std::span<TileRenderer> tiles, const ThreadLimit& limit)
      : gpu_(gpu), job_(job), tiles_(tiles), limit_(limit) {}

  std::uint64_t rays_on_gpu() const { return rays_on_gpu_; }

  /// Calls body(number) for all tiles, on many threads.
  template <class Body> build::Result<void> for_each_tile(Body&& body) {
    const auto range = [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) body(i);
    };
    if (parallel_batches(tiles_.size(), 1, limit_, range)) return {};
    return tl::unexpected(build::Error{build::ErrorCode::kCancelled, "cancelled, nothing was written"});
  }

  /// Traces what @p part, primary() or shadows(), gives for each tile.
  build::Result<void> trace_all(TileRays (TileRenderer::*part)()) {
    work_.clear();
    first_.assign(1, 0);
    for (TileRenderer& tile : tiles_) {
      work_.push_back((tile.*part)());
      first_.push_back(first_.back() + work_.back().rays.size());
    }
    const bool counting = !work_.front().costs.empty();
    return counting || first_.back() < kSmallBatch ? trace_on_cpu() : trace_on_gpu();
  }

 private:
  build::Result<void> trace_on_cpu() {
    return for_each_tile([&](std::size_t i) {
      const TileRays& work = work_[i];
      if (!work.rays.empty()) trace(job_.scene, work.query, {}, work.rays, work.hits, work.costs, work.paths);
    });
  }

  build::Result<void> trace_on_gpu() {
    const std::size_t count = first_.back();
    rays_.resize(std::max(rays_.size(), count));
    hits_.resize(rays_.size());
    auto gathered =
        for_each_tile([&](std::size_t i) { std::ranges::copy(work_[i].rays, rays_.begin() + at(first_[i])); });
    if (!gathered) return gathered;
    const auto seconds =
        gpu_.trace(work_.front().query, {}, std::span(rays_).first(count), std::span(hits_).first(count));
    if (!seconds) return tl::unexpected(seconds.error());
    rays_on_gpu_ += count;
    return for_each_tile([&](std::size_t i) {
      std::copy_n(hits_.begin() + at(first_[i]), work_[i].hits.size(), work_[i].hits.begin());
    });
  }

  static std::ptrdiff_t at(std::size_t i) { return static_cast<std::ptrdiff_t>(i); }

  GpuTracer& gpu_;
  const RenderJob& job_;
  std::span<TileRenderer> tiles_;
  const ThreadLimit& limit_;
  std::vector<TileRays> work_;
  std::vector<std::size_t> first_;  ///< Index in rays_ of each tile's first ray, then the total number.
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
  std::uint64_t rays_on_gpu_ = 0;
};

}  // namespace

build::Result<std::uint64_t> render_together(GpuTracer& gpu, const RenderJob& job, std::span<TileRenderer> tiles,
                                             const PassRange& range, const ThreadLimit& limit,
                                             const std::function<void(double)>& progress) {
  Batches batches(gpu, job, tiles, limit);
  for (unsigned pass = range.first; pass < range.end; ++pass) {
    auto done = batches.for_each_tile([&](std::size_t i) { tiles[i].make_rays(pass); });
    if (done) done = batches.trace_all(&TileRenderer::primary);
    if (done) done = batches.for_each_tile([&](std::size_t i) { tiles[i].shade(pass); });
    if (done) done = batches.trace_all(&TileRenderer::shadows);
    if (done) done = batches.for_each_tile([&](std::size_t i) { tiles[i].add_shadows(); });
    if (!done) return tl::unexpected(std::move(done.error()));
    if (progress) progress(static_cast<double>(pass + 1 - range.first) / (range.end - range.first));
  }
  if (range.end != TileRenderer::passes(job.options)) return batches.rays_on_gpu();
  auto done = batches.for_each_tile([&](std::size_t i) { tiles[i].finish(); });
  if (!done) return tl::unexpected(std::move(done.error()));
  return batches.rays_on_gpu();
}

}  // namespace hiprt::tools
