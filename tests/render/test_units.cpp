/// Pictures as units of work: every step of every pixel counts once and in order, whoever computes it.

#include "path_scenes.h"
#include "unit_fakes.h"

#include <tests/amount.h>
#include <tools/base/interrupt.h>
#include <tools/render/units/path_work.h>
#include <tools/render/units/picture_run.h>
#include <tools/render/units/studio_work.h>
#include <tools/render/units/unit_dealer.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <optional>
#include <span>
#include <utility>

using namespace hiprt;
using namespace hiprt::test;
using namespace hiprt::tools;

namespace {

std::uint64_t total_pixels(const PictureGrid& grid) {
  std::uint64_t sum = 0;
  for (std::uint32_t tile = 0; tile < grid.tiles(); ++tile) sum += grid.unit(tile, 1, 0, 1).pixels();
  return sum;
}

/// Computes all units of a random partition of the picture, each from what the earlier ones left.
PictureState in_random_units(PictureWork& work, std::uint32_t width, std::uint32_t height, oracle::Random& random) {
  constexpr std::array<std::uint32_t, 4> kSides{5, 8, 32, 77};
  PictureState state({width, height, kSides[random.below(4)]}, work.pixel_bytes());
  std::vector<std::uint32_t> open(state.grid.tiles());
  for (std::uint32_t i = 0; i < open.size(); ++i) open[i] = i;
  while (!open.empty()) {
    const std::uint32_t at = random.below(static_cast<std::uint32_t>(open.size())), tile = open[at];
    const std::uint32_t left = work.steps() - state.done[tile], steps = 1 + random.below(left);
    const PictureUnit unit = state.grid.unit(tile, 1, state.done[tile], steps);
    std::vector<std::byte> part = state.cut(unit);
    REQUIRE(work.run(unit, part).has_value());
    state.paste(unit, part);
    state.advance(unit);
    if (steps == left) open.erase(open.begin() + at);
  }
  return state;
}

/// Every bit of every pixel.
bool same_pixels(const Image& a, const Image& b) {
  return std::ranges::equal(std::as_bytes(std::span(a.pixels)), std::as_bytes(std::span(b.pixels)));
}

}  // namespace

TEST_CASE("a grid's tiles cover the picture once, and there are some for every worker") {
  for (const auto& [width, height] : {std::pair{1u, 1u}, {33u, 25u}, {1024u, 1u}, {640u, 480u}})
    for (const unsigned workers : {1u, 7u, 1000u}) {
      const PictureGrid grid = choose_grid(width, height, workers);
      CHECK(total_pixels(grid) == std::uint64_t{width} * height);
      CHECK((grid.tile == 8 || grid.tiles() >= 8 * workers));
    }
}

TEST_CASE("units on failing ranks: the pixels are those of one process") {
  const std::uint64_t first_seed = 20261127;
  for (std::uint64_t seed = first_seed; seed < first_seed + checks::trials(300); ++seed) {
    CAPTURE(seed);
    oracle::Random random(seed);
    const std::uint32_t width = 1 + random.below(100), height = 1 + random.below(60);
    HashWork work(1 + random.below(50), 1 + random.below(3));
    const unsigned ranks = 1 + random.below(6);
    FailingCrew crew(work, ranks, random.bits(), random.coin() ? 0.02 : 0.0);
    PictureState state(choose_grid(width, height, ranks), work.pixel_bytes());
    const auto whole = compute(work, state, random.below(4) == 0 ? nullptr : &crew, nullptr, {});
    REQUIRE((whole && *whole));
    CHECK(state.pixels == work.whole(width, height));
    CHECK(state.rays.primary == std::uint64_t{width} * height * work.steps());
  }
}

TEST_CASE("a dealer: no tile is in two hands, and a lost rank's tiles are dealt again") {
  const PictureGrid grid{64, 64, 32};
  const std::vector<std::uint32_t> nothing(grid.tiles());
  UnitDealer dealer(grid, 4, nothing, 3);
  CHECK_FALSE(dealer.next(1).has_value());
  dealer.join(1, 1);
  dealer.join(2, 8);
  const auto first = dealer.next(1), second = dealer.next(1);
  REQUIRE((first && second));
  CHECK_FALSE(*first == *second);
  CHECK_FALSE(dealer.next(1).has_value());
  const auto third = dealer.next(2), fourth = dealer.next(2);
  REQUIRE((third && fourth));
  CHECK_FALSE(dealer.next(2).has_value());
  dealer.leave(1);
  CHECK_FALSE(dealer.take(1, *first, 1.0));
  const auto again = dealer.next(2);
  REQUIRE(again);
  CHECK((*again == *first || *again == *second));
  CHECK(dealer.take(2, *again, 1.0));
  CHECK_FALSE(dealer.take(2, *again, 1.0));
  CHECK(dealer.fraction() == Approx(1.0 / 16));
}

TEST_CASE("a dealer: fast ranks get large units, and units become short at the end") {
  const PictureGrid grid{1024, 1024, 32};
  const std::vector<std::uint32_t> nothing(grid.tiles());
  UnitDealer dealer(grid, 64, nothing, 2);
  dealer.join(0, 1);
  dealer.join(1, 1);
  // Steps of pixels per second. An oracle of time: each rank computes one unit after the other.
  const std::array<double, 2> speed{1e5, 1e7};
  std::array<double, 2> now{}, done{};
  while (!dealer.finished()) {
    const unsigned rank = now[0] <= now[1] ? 0 : 1;
    const auto unit = dealer.next(rank);
    if (!unit) {
      now[rank] = std::max(now[0], now[1]) + 1e-3;
      continue;
    }
    const double work = static_cast<double>(unit->pixels()) * unit->steps, seconds = work / speed[rank];
    CHECK(seconds < 0.8);
    REQUIRE(dealer.take(rank, *unit, seconds));
    now[rank] += seconds;
    done[rank] += work;
  }
  CHECK(done[0] + done[1] == 1024.0 * 1024 * 64);
  // The best possible is the work by the sum of the speeds.
  CHECK(std::max(now[0], now[1]) < 1.05 * 1024 * 1024 * 64 / (speed[0] + speed[1]));
}

TEST_CASE("an interrupted computation says that the picture is not whole") {
  HashWork work(50, 1);
  PictureState state({300, 200, 32}, work.pixel_bytes());
  PictureHooks hooks;
  hooks.fraction = [](double fraction) {
    if (fraction > 0.2) std::raise(SIGINT);
  };
  std::optional<InterruptGuard> guard(std::in_place);
  const auto whole = compute(work, state, nullptr, nullptr, hooks);
  // A new guard forgets the signal.
  guard.reset();
  guard.emplace();
  REQUIRE(whole.has_value());
  CHECK_FALSE(*whole);
  CHECK(*std::ranges::max_element(state.done) > 0);
}

TEST_CASE("studio pictures in random units have the pixels of render()") {
  const std::vector<oracle::Mesh> meshes{floor_square(4.0f)};
  const PathTestScene scene = flat_scene(meshes, {{}});
  const BufferView file = scene.view();
  const SceneView view = make_scene_view(file);
  const Camera camera{{0, 3, 5}, {0, 0, 0}, {0, 1, 0}, 50};
  oracle::Random random(20261128);
  for (const RenderMode mode : {RenderMode::kAo, RenderMode::kPrimary, RenderMode::kNormals, RenderMode::kHeatmap})
    for (const std::uint32_t samples : {1u, 5u})
      for (const bool layers : {false, true}) {
        CAPTURE(mode, samples, layers);
        RenderOptions options{.mode = mode, .width = 75, .height = 41, .samples = samples, .threads = 2};
        options.layers = layers;
        const auto expected = render(view, camera, options);
        REQUIRE(expected.has_value());
        StudioWork work(view, camera, options, nullptr);
        const PictureState state = in_random_units(work, options.width, options.height, random);
        const Rendering found = work.picture(state.pixels);
        CHECK(same_pixels(found.image, expected->image));
        CHECK(found.mean_steps == expected->mean_steps);
      }
}

TEST_CASE("path-traced pictures in random units have the sums of trace_paths()") {
  const PathTestScene scene = flat_scene({floor_square(4.0f)}, {{}});
  const PathData data = data_of(scene, [](const Vec3& d) { return Vec3(1.0f + d.y); });
  const BufferView file = scene.view();
  const SceneView view = make_scene_view(file);
  const Camera camera{{0, 3, 5}, {0, 0, 0}, {0, 1, 0}, 50};
  const PathOptions options{.width = 75, .height = 41, .samples = 7, .threads = 2};
  const PathPicture expected = trace_well(scene, data, camera, options);
  oracle::Random random(20261129);
  for (unsigned i = 0; i < checks::trials(20) + 1; ++i) {
    PathWork work(view, data, camera, options, nullptr);
    const PictureState state = in_random_units(work, options.width, options.height, random);
    const PathPicture found = picture_of(state.pixels, work.steps(), work.workers());
    CHECK(same_sums(found, expected));
    CHECK(found.samples == 7);
  }
}
