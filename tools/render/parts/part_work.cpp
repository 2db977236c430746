#include <tools/render/parts/part_work.h>

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/render/path/cpu_path_engine.h>
#include <tools/render/path/path_tile.h>
#include <tools/render/path/path_wave.h>
#include <tools/render/studio/render_tile.h>

#include <sys/resource.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

namespace hiprt::tools {
namespace {

/// More paths in a wave bring nothing: messages of a few hundred kilobytes are long enough.
constexpr std::size_t kMostPathsOfWave = 65536;

/// Memory of a path of a wave: PathQueues and the arrays of PartPathEngine, and a tour's.
std::size_t bytes_of_path(std::uint32_t levels) {
  return sizeof(PathState) + 3 * sizeof(Ray) + 2 * sizeof(Hit) + sizeof(PathSurface) + sizeof(Vec3) +
         4 * (3 + 2 * levels) + 3 * sizeof(std::uint64_t) + 4 * sizeof(PartVisit);
}

}  // namespace

class PartPathEngine : public HostPathSteps {
 public:
  PartPathEngine(PartExchange& exchange, unsigned slot, std::size_t paths, const std::atomic<bool>& stopped)
      : exchange_(exchange),
        slot_(slot),
        stopped_(stopped),
        surfaces_(paths),
        paths_(paths * exchange.manifest().levels) {}

  /// Surfaces come with the hits.
  template <class Stage> build::Result<void> for_each(std::uint32_t count, const PathJob& job) const {
    run_step(Stage::kStage, job, count, surfaces_.data());
    return {};
  }
  build::Result<void> trace(Query query, const Ray* rays, std::uint32_t count, Hit* hits,
                            std::uint32_t* instance_paths) {
    const TourHits found{hits, paths_.data(), surfaces_.data(), exchange_.manifest().levels};
    return exchange_.trace(query, {rays, count}, found, instance_paths, slot_, stopped_, counts_);
  }
  const RayCounts& counts() const { return counts_; }

 private:
  PartExchange& exchange_;
  unsigned slot_;
  const std::atomic<bool>& stopped_;
  std::vector<PathSurface> surfaces_;
  std::vector<std::uint32_t> paths_;  ///< Of the whole scene.
  RayCounts counts_;                  ///< What has gone between processes.
};

build::Result<RayMemory> RayMemory::divide(std::uint64_t bytes, unsigned ranks, unsigned workers,
                                           std::uint32_t levels) {
  const std::uint64_t path = std::uint64_t{workers} * bytes_of_path(levels);
  // Each is there twice: as a message, and taken apart.
  const std::uint64_t on_way = 2 * (kQuestionRayBytes + answer_ray_bytes(levels));
  const std::uint64_t all_on_way = 2 * std::uint64_t{ranks - 1} * on_way;
  const RayMemory memory{static_cast<std::size_t>(std::min<std::uint64_t>(bytes / 2 / path, kMostPathsOfWave)),
                         static_cast<std::size_t>(ranks == 1 ? 1 : bytes / 2 / all_on_way)};
  if (memory.paths != 0 && memory.credit != 0) return memory;
  return invalid_input("--ray-memory is too small for " + std::to_string(workers) + " threads and " +
                       std::to_string(ranks) + " ranks: it has to be at least " +
                       std::to_string(2 * std::max(path, all_on_way)) + " bytes");
}

PartWork::PartWork(const PathScene& scene, PartExchange& exchange, std::uint32_t samples, unsigned workers,
                   std::size_t paths)
    : scene_(scene), exchange_(exchange), samples_(samples), workers_(workers), paths_(paths) {
  for (unsigned slot = workers; slot-- > 0;) free_slots_.push_back(slot);
}

build::Result<void> PartWork::enter() {
  // All processes wait for the one whose parts most rays visit. That one should answer first and follow its own paths
  // later. On Linux each thread has a priority. If it cannot be set, the picture is the same.
  constexpr int kNiceness = 10;
  static_cast<void>(::setpriority(PRIO_PROCESS, 0, kNiceness));
  return {};
}

unsigned PartWork::take_slot() {
  const std::lock_guard lock(mutex_);
  const unsigned slot = free_slots_.back();
  free_slots_.pop_back();
  return slot;
}

build::Result<RayCounts> PartWork::run(const PictureUnit& unit, std::span<std::byte> state) {
  std::vector<PathSum> sums(unit.pixels());
  if (unit.first != 0) std::memcpy(sums.data(), state.data(), state.size());
  const unsigned slot = take_slot();
  const auto most = static_cast<std::uint32_t>(std::min<std::uint64_t>(paths_, unit.pixels() * unit.steps));
  PartPathEngine engine(exchange_, slot, most, stopped_);
  auto wave = PathWave<PartPathEngine>::make(engine, scene_, most);
  PathRayCounts rays;
  build::Result<void> done;
  if (!wave) done = tl::unexpected(std::move(wave.error()));
  // As large as the memory allows: whole rows, and several samples side by side.
  const std::uint32_t width = std::min(unit.width, most), height = std::clamp(most / width, 1u, unit.height);
  const std::uint32_t samples = std::clamp(most / (width * height), 1u, unit.steps);
  const PathSums all{sums.data(), unit.left, unit.top, unit.width};
  for (std::uint32_t s = 0; s < unit.steps; s += samples)
    for (std::uint32_t y = 0; y < unit.height; y += height)
      for (std::uint32_t x = 0; x < unit.width && done && !interrupted(); x += width) {
        const PathBatch batch{unit.left + x,
                              unit.top + y,
                              std::min(width, unit.width - x),
                              std::min(height, unit.height - y),
                              unit.first + s,
                              std::min(samples, unit.steps - s)};
        done = wave->run(batch, all, rays);
      }
  if (done) done = check(rays);
  {
    const std::lock_guard lock(mutex_);
    free_slots_.push_back(slot);
  }
  if (!done) return tl::unexpected(std::move(done.error()));
  std::memcpy(state.data(), sums.data(), state.size());
  RayCounts counts = engine.counts();
  counts.primary = rays.camera;
  counts.secondary = rays.secondary;
  counts.shadow = rays.shadow;
  return counts;
}

build::Result<void> store_part_layers(const PathScene& scene, PartExchange& exchange, unsigned slot,
                                      const std::atomic<bool>& stopped, Image& image) {
  const PathSettings& settings = scene.settings;
  const std::uint32_t levels = exchange.manifest().levels, own_levels = scene.view.levels;
  image.has_instances = true;
  image.has_costs = false;
  image.shading.resize(image.pixels.size());
  RayCounts not_told;
  std::vector<Ray> rays(settings.width);
  std::vector<Hit> hits(settings.width);
  std::vector<PathSurface> surfaces(settings.width);
  std::vector<std::uint32_t> paths(std::size_t{settings.width} * levels);
  std::vector<std::uint32_t> own_paths(std::size_t{settings.width} * own_levels);
  for (std::uint32_t y = 0; y < settings.height; ++y) {
    for (std::uint32_t x = 0; x < settings.width; ++x) {
      rays[x] = settings.camera.ray(x + 0.5, y + 0.5);
      rays[x].time = 0.5f * settings.shutter.open + 0.5f * settings.shutter.close;
    }
    const TourHits found{hits.data(), paths.data(), surfaces.data(), levels};
    if (auto traced = exchange.trace(Query::kClosest, rays, found, own_paths.data(), slot, stopped, not_told); !traced)
      return traced;
    for (std::uint32_t x = 0; x < settings.width; ++x) {
      const Hit& hit = hits[x];
      if (!hit.found()) continue;
      store_centre_hit(rays[x], hit, paths[std::size_t{x} * levels], image.at(x, y));
      ShadingPixel& pixel = image.shading[std::size_t{y} * settings.width + x];
      pixel.albedo = surfaces[x].base_color;
      pixel.normal = surfaces[x].normal;
      pixel.u = surfaces[x].coordinates.u;
      pixel.v = surfaces[x].coordinates.v;
    }
  }
  return {};
}

}  // namespace hiprt::tools
