/// Rays through a scene in parts find what they find in the whole scene, bit by bit.

#include "part_scenes.h"

#include <tests/amount.h>
#include <tools/render/parts/part_work.h>
#include <tools/render/path/cpu_path_engine.h>
#include <tools/render/units/path_work.h>
#include <tools/render/units/picture_state.h>

#include <atomic>
#include <limits>
#include <set>
#include <span>
#include <vector>

using namespace hiprt;
using namespace hiprt::test;
using namespace hiprt::tools;

namespace {

const Camera kCamera{{1.0, 2.0, 7.0}, {0, 0, 0}, {0, 1, 0}, 50};
const PathOptions kOptions{.width = 37, .height = 29, .samples = 3, .bounces = 5, .shutter = {0.0f, 1.0f}};
constexpr std::atomic<bool> kNeverStopped = false;

std::vector<Ray> random_rays(oracle::Random& random, std::size_t count) {
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) {
    const auto from = random.in_cube(5.0), to = random.in_cube(2.5);
    ray.origin = Vec3(from[0], from[1], from[2]);
    ray.direction = Vec3(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
    // Straight down at squares that lie in each other, too.
    if (random.below(4) == 0) ray.direction = Vec3(0, -1, 0);
    if (random.coin()) ray.tmax = random.uniform_float(0.0, 1.5);
    ray.time = random.uniform_float(-0.5, 1.5);
  }
  rays[0].direction = Vec3(0.0f);
  rays[1].origin.x = std::numeric_limits<float>::quiet_NaN();
  rays[2].tmax = -1.0f;
  return rays;
}

/// NaN and both zeros count, too.
bool same_bits(const auto& a, const auto& b) {
  const auto bytes_a = std::as_bytes(std::span(&a, 1)), bytes_b = std::as_bytes(std::span(&b, 1));
  return std::equal(bytes_a.begin(), bytes_a.end(), bytes_b.begin());
}

struct Found {
  Found(std::size_t rays, std::uint32_t levels_of_scene, std::uint32_t shared_levels)
      : hits(rays),
        paths(rays * levels_of_scene),
        surfaces(rays),
        shared_paths(rays * shared_levels),
        levels(levels_of_scene) {}

  TourHits views() { return {hits.data(), paths.data(), surfaces.data(), levels}; }

  std::vector<Hit> hits;
  std::vector<std::uint32_t> paths;
  std::vector<PathSurface> surfaces;
  std::vector<std::uint32_t> shared_paths;
  std::uint32_t levels;
};

/// Compares all that rays find. @return the number of hits.
std::size_t compare(const WholeScene& whole, PartProcess& process, std::span<const Ray> rays) {
  const auto count = static_cast<std::uint32_t>(rays.size());
  const PathScene& scene = whole.scene();
  const std::uint32_t levels = scene.view.levels;
  const CpuPathEngine engine(scene, has_alpha_cutout(whole.data()));
  std::vector<Hit> hits(count);
  std::vector<std::uint32_t> paths(std::size_t{count} * levels);
  REQUIRE(engine.trace(Query::kClosest, rays.data(), count, hits.data(), paths.data()).has_value());
  Found found(count, process.exchange().manifest().levels, process.scene().view.levels);
  REQUIRE(found.levels == levels);
  RayCounts counts;
  REQUIRE(process.exchange()
              .trace(Query::kClosest, rays, found.views(), found.shared_paths.data(), 0, kNeverStopped, counts)
              .has_value());
  std::size_t hit_count = 0;
  for (std::size_t i = 0; i < count; ++i) {
    CAPTURE(i);
    REQUIRE(same_bits(hits[i], found.hits[i]));
    const auto path = std::span(paths).subspan(i * levels, levels);
    REQUIRE(std::equal(path.begin(), path.end(), found.paths.begin() + static_cast<std::ptrdiff_t>(i * levels)));
    if (!hits[i].found()) continue;
    ++hit_count;
    const PathSurface expected = surface_at(scene, rays[i], hits[i], load_path(path));
    const PathSurface& surface = found.surfaces[i];
    REQUIRE(expected.geometric == surface.geometric);
    REQUIRE(expected.normal == surface.normal);
    REQUIRE(expected.base_color == surface.base_color);
    REQUIRE(expected.metallic == surface.metallic);
    REQUIRE(expected.roughness == surface.roughness);
    REQUIRE(expected.emission == surface.emission);
    REQUIRE(same_bits(expected.coordinates, surface.coordinates));
    // Lights are found by the path in the shared part, and nothing else is.
    const std::uint32_t shared = process.scene().view.levels;
    const bool is_shared = shared != 0 && found.shared_paths[i * shared] != kInvalidId;
    REQUIRE((max_component(surface.emission) == 0.0f || is_shared));
  }
  REQUIRE(engine.trace(Query::kAny, rays.data(), count, hits.data(), nullptr).has_value());
  Found any(count, levels, process.scene().view.levels);
  REQUIRE(process.exchange().trace(Query::kAny, rays, any.views(), nullptr, 0, kNeverStopped, counts).has_value());
  for (std::size_t i = 0; i < count; ++i) REQUIRE(hits[i].found() == any.hits[i].found());
  return hit_count;
}

/// The sums of a picture by units, in an order of their own.
std::vector<PathSum> render(PictureWork& work, std::uint32_t steps_of_unit) {
  PictureState state({kOptions.width, kOptions.height, 16}, work.pixel_bytes());
  for (std::uint32_t first = 0; first < work.steps(); first += steps_of_unit)
    for (std::uint32_t tile = 0; tile < state.grid.tiles(); ++tile) {
      const PictureUnit unit = state.grid.unit(tile, 1, first, std::min(steps_of_unit, work.steps() - first));
      auto part = state.cut(unit);
      const auto done = work.run(unit, part);
      INFO((done ? std::string() : done.error().message));
      REQUIRE(done.has_value());
      state.paste(unit, part);
    }
  return picture_of(state.pixels, work.steps(), 1).sums;
}

/// Checks what it is told, and notes who had the best hit.
class Witness final : public TourWatcher {
 public:
  void begin(Query, std::size_t rays) override {
    CHECK(!is_inside_);
    is_inside_ = true;
    visited_.assign(rays, {});
    best_.assign(rays, std::numeric_limits<float>::infinity());
  }
  void begin_visit() override {
    CHECK(is_inside_);
    CHECK(!is_visiting_);
    is_visiting_ = true;
  }
  void end_visit(const RayTour::Parcel& parcel, const PartAnswer& answer) override {
    CHECK(is_visiting_);
    is_visiting_ = false;
    CHECK(!parcel.numbers.empty());
    REQUIRE(answer.results.size() == parcel.numbers.size());
    std::size_t next = 0;
    for (std::size_t k = 0; k < parcel.numbers.size(); ++k) {
      const std::uint32_t ray = parcel.numbers[k];
      // A ray visits a part once.
      REQUIRE(visited_[ray].insert(parcel.part).second);
      if (answer.query == Query::kClosest && answer.results[k] == VisitResult::kHit)
        best_[ray] = std::min(best_[ray], answer.hits[next++].hit.t);
    }
  }
  void end() override {
    CHECK(is_inside_);
    is_inside_ = false;
  }

  bool is_inside() const { return is_inside_; }
  const std::set<std::uint32_t>& visited(std::size_t ray) const { return visited_[ray]; }
  float best(std::size_t ray) const { return best_[ray]; }

 private:
  bool is_inside_ = false, is_visiting_ = false;
  std::vector<std::set<std::uint32_t>> visited_;
  std::vector<float> best_;
};

}  // namespace

TEST_CASE("parts: a watcher is told of every visit") {
  const std::uint64_t seed = 11;
  oracle::Random random(seed);
  const PathSettings settings = settings_of(kOptions, kCamera);
  const PartedScene parts(seed, {}, true, 4);
  PartProcess process(parts, settings, nullptr, 1);
  Witness witness;
  process.exchange().watch(witness);
  const std::vector<Ray> rays = random_rays(random, 400);
  Found found(rays.size(), process.exchange().manifest().levels, process.scene().view.levels);
  RayCounts counts;
  REQUIRE(process.exchange()
              .trace(Query::kClosest, rays, found.views(), found.shared_paths.data(), 0, kNeverStopped, counts)
              .has_value());
  CHECK(!witness.is_inside());
  std::size_t several = 0, in_parts = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    several += witness.visited(i).size() > 1 ? 1 : 0;
    const bool is_shared = found.shared_paths[i * process.scene().view.levels] != kInvalidId;
    if (!found.hits[i].found() || is_shared) continue;
    ++in_parts;
    CHECK(witness.best(i) == found.hits[i].t);
  }
  CHECK(several > 10);
  CHECK(in_parts > 10);
}

TEST_CASE("parts: closest hits, their surfaces and any hits are those of the whole scene") {
  const unsigned scenes = checks::trials(60);
  std::size_t hits = 0;
  for (unsigned i = 0; i < scenes; ++i) {
    const std::uint64_t seed = 20261128 + i;
    CAPTURE(seed);
    oracle::Random random(seed);
    const PartSceneOptions options{i % 4, 2 + i % 5, (i & 1u) != 0, (i & 2u) != 0, i % 3 == 0};
    const bool surfaces = i % 5 != 4;
    const PathSettings settings = settings_of(kOptions, kCamera);
    const WholeScene whole(seed, options, surfaces, settings);
    const PartedScene parts(seed, options, surfaces, 1 + random.below(4));
    PartProcess process(parts, settings, nullptr, 1);
    hits += compare(whole, process, random_rays(random, 400));
  }
  CHECK(hits > scenes * 20u);
}

TEST_CASE("parts: a picture has the same bits as that of the whole scene, whatever the waves are") {
  for (const bool surfaces : {true, false}) {
    const std::uint64_t seed = 7;
    const PathSettings settings = settings_of(kOptions, kCamera);
    const WholeScene whole(seed, {}, surfaces, settings);
    const PathPicture expected = [&] {
      auto picture = trace_paths(whole.scene().view, whole.data(), kCamera, kOptions);
      REQUIRE(picture.has_value());
      return std::move(*picture);
    }();
    const PartedScene parts(seed, {}, surfaces, 3);
    CHECK(parts.manifest().shared.has_value() == surfaces);
    PartProcess process(parts, settings, nullptr, 1);
    for (const std::size_t paths : {1u, 5u, 100u, 100000u})
      for (const std::uint32_t steps : {1u, 2u, 3u}) {
        CAPTURE(surfaces, paths, steps);
        PartWork work(process.scene(), process.exchange(), kOptions.samples, 1, paths);
        PathPicture found = expected;
        found.sums = render(work, steps);
        CHECK(same_sums(expected, found));
      }
  }
}

TEST_CASE("parts: boxes near the root hold every part, and a router misses no part with a hit") {
  oracle::Random random(3);
  const PathSettings settings = settings_of(kOptions, kCamera);
  for (unsigned i = 0; i < checks::trials(30); ++i) {
    const std::uint64_t seed = 500 + i;
    CAPTURE(seed);
    const PartedScene parts(seed, {.groups = i % 3, .moving = i % 2 == 0}, false, 4);
    const PartRouter router(parts.manifest().parts);
    const std::vector<Ray> rays = random_rays(random, 300);
    for (std::uint32_t k = 0; k < 4; ++k) {
      auto files = parts.load(parts.manifest().parts[k]);
      auto tracer = PartTracer::make(std::move(files.bvh), std::move(files.data), parts.manifest().levels, settings);
      REQUIRE(tracer.has_value());
      const PartAnswer answer = (*tracer)->trace(Query::kClosest, rays).value();
      std::size_t next = 0;
      for (std::size_t r = 0; r < rays.size(); ++r) {
        if (answer.results[r] != VisitResult::kHit) continue;
        const PartHit& hit = answer.hits[next++];
        std::vector<PartVisit> visits;
        router.route(rays[r], visits);
        const auto visit = std::find_if(visits.begin(), visits.end(), [&](const PartVisit& v) { return v.part == k; });
        REQUIRE(visit != visits.end());
        REQUIRE(visit->enter <= hit.hit.t);
        REQUIRE(std::is_sorted(visits.begin(), visits.end(), [](auto& a, auto& b) { return a.enter < b.enter; }));
      }
    }
  }
}
