// Instances in one place: the path decides, in closest hits and in all hits. And flags and overflows below the first
// level.

#include <tests/traversal/instances/instance_scenes.h>

#include <algorithm>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr unsigned kCopies = 15;

template <unsigned kLevels> struct Tracer : Instanced<Policies, kLevels> {};

/// One square of two triangles, and a triangle beside it at @p height.
oracle::Mesh square(float height = 0.0f) {
  oracle::Mesh mesh;
  mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {2, 2, height}, {3, 2, height}, {2, 3, height}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}};
  return mesh;
}

Ray ray_at(float x, float y) { return {.origin = {x, y, -1}, .direction = {0, 0, 1}}; }

/// Copies of one square in one place, through @p levels levels: the outer groups hold two copies of the inner one.
InstanceScene coincident(unsigned levels) {
  InstanceScene scene;
  // The boxes of later copies are nearer, so rays enter them first.
  scene.groups.emplace_back();
  for (unsigned i = 0; i < kCopies; ++i) {
    scene.add_file({square(-0.05f * static_cast<float>(i))}, NodeLayout::kPlanes);
    scene.groups[0].push_back({.object = i});
  }
  for (unsigned level = 1; level < levels; ++level)
    scene.groups.emplace_back(2, Instance{.object = kCopies + level - 1});
  scene.build();
  return scene;
}

template <unsigned kLevels> void check_paths(unsigned levels, bool split) {
  CAPTURE(levels, split);
  const InstanceScene scene = coincident(levels);
  SceneView view = scene.view();
  // The bit without need is no error, and chooses how AllHits searches.
  if (split) view.features |= feature_bit(Feature::kSplitReferences);
  const Ray ray = ray_at(0.3f, 0.1f);
  const auto first = closest_hit<Tracer<kLevels>>(view, ray);
  REQUIRE(first.found());
  REQUIRE(first.path.depth == levels);
  for (unsigned i = 0; i < levels; ++i) CHECK(first.path.instance[i] == 0);

  std::vector<InstancePath<kLevels>> paths;
  typename Tracer<kLevels>::Stack::Memory memory;
  AllHits<Tracer<kLevels>> query(view, ray, memory);
  for (auto hit = query.next_hit(); hit.found(); hit = query.next_hit()) paths.push_back(hit.path);
  const std::size_t expected = std::size_t{kCopies} << (levels - 1);
  CHECK(paths.size() == expected);
  if (split) CHECK(std::is_sorted(paths.begin(), paths.end()));
  std::sort(paths.begin(), paths.end());
  CHECK(std::unique(paths.begin(), paths.end()) == paths.end());
}

struct RejectAll {
  template <class Hit> HIPRT_HD FilterResult operator()(const Ray&, const Hit&) const { return FilterResult::kReject; }
};

}  // namespace

TEST_CASE("of coincident instances the lowest path wins, and all hits are found") {
  for (const bool split : {false, true}) {
    check_paths<1>(1, split);
    check_paths<3>(1, split);
    check_paths<3>(2, split);
    check_paths<3>(3, split);
  }
}

TEST_CASE("a flag against filters counts on every level") {
  for (unsigned flagged = 0; flagged < 3; ++flagged) {
    CAPTURE(flagged);
    InstanceScene scene;
    scene.add_file({square()}, NodeLayout::kPlanes);
    for (unsigned level = 0; level < 3; ++level)
      scene.groups.push_back({Instance{.object = level, .without_filter = level == flagged}});
    scene.build();
    typename Tracer<3>::Stack::Memory memory;
    const SceneView view = scene.view();
    CHECK(ClosestHit<Tracer<3>, RejectAll>(view, ray_at(0.3f, 0.1f), memory).next_hit().found());
  }
  InstanceScene scene;
  scene.add_file({square()}, NodeLayout::kPlanes);
  for (unsigned level = 0; level < 3; ++level) scene.groups.push_back({Instance{.object = level}});
  scene.build();
  typename Tracer<3>::Stack::Memory memory;
  const SceneView view = scene.view();
  CHECK_FALSE(ClosestHit<Tracer<3>, RejectAll>(view, ray_at(0.3f, 0.1f), memory).next_hit().found());
}

namespace {

template <unsigned kEntries> struct SmallStack : Policies { using Stack = PrivateStack<kEntries>; };

/// A row of squares behind each other, so that the stack holds many entries when a ray enters the last instance.
template <unsigned kEntries> unsigned check_entering(const InstanceScene& scene) {
  using P = Instanced<SmallStack<kEntries>, 2>;
  const SceneView view = scene.view();
  unsigned failed = 0;
  std::uint32_t overflows = 0;
  oracle::Random random(77);
  for (unsigned i = 0; i < 400; ++i) {
    const Ray ray = random_ray(random, 6.0);
    const auto expected = closest_hit<Tracer<2>>(view, ray);
    typename P::Stack::Memory memory;
    typename P::Stack::Storage storage(memory);
    storage.overflowed_rays = &overflows;
    const auto hit = closest_hit<P>(view, ray, storage);
    INFO("ray " << i << ", entries " << kEntries);
    if (hit.failed()) {
      ++failed;
    } else {
      REQUIRE(hit.found() == expected.found());
      REQUIRE(hit.t == expected.t);
      REQUIRE(hit.path == expected.path);
    }
    REQUIRE(overflows == failed);
  }
  return failed;
}

}  // namespace

TEST_CASE("a stack too small inside instances fails and is counted") {
  InstanceScene scene;
  scene.add_file({oracle::icosphere(0)}, NodeLayout::kPlanes);
  oracle::Random random(78);
  scene.groups.emplace_back();
  for (unsigned i = 0; i < 60; ++i) scene.groups[0].push_back({.to_scene = random_affine(random, 2.0)});
  scene.groups.emplace_back(3, Instance{.object = 1});
  for (Instance& instance : scene.groups[1]) instance.to_scene = random_affine(random, 1.0);
  scene.build();
  unsigned failed = 0, passed = 0;
  const auto add = [&](unsigned count) {
    failed += count;
    passed += 400 - count;
  };
  add(check_entering<4>(scene));
  add(check_entering<5>(scene));
  add(check_entering<6>(scene));
  add(check_entering<8>(scene));
  add(check_entering<12>(scene));
  add(check_entering<32>(scene));
  CHECK(failed > 50);
  CHECK(passed > 50);
}
