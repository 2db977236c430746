// A scene of one instance, traced by policies without levels: hits equal those of policies with one level, bit for bit.

#include <hiprt_build/format/only_instance.h>
#include <tests/traversal/instances/instance_scenes.h>

#include <bit>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261125;

InstanceScene scene_of(NodeLayout layout, std::vector<Instance> group) {
  InstanceScene scene;
  scene.add_file({oracle::soup(200, 0.5, kSeed), oracle::torus(12, 8, 0.4)}, layout);
  scene.add_file({{}}, layout);
  scene.groups.push_back(std::move(group));
  scene.build();
  return scene;
}
std::optional<PlacedObject> placed(const InstanceScene& scene) {
  return only_instance(*open_buffer(scene.file.bytes()));
}

bool same(const PathHit<1>& a, const PathHit<1>& b) {
  using Words = std::array<std::uint32_t, sizeof(Hit) / 4>;
  return std::bit_cast<Words>(static_cast<const Hit&>(a)) == std::bit_cast<Words>(static_cast<const Hit&>(b)) &&
         a.path == b.path;
}

}  // namespace

TEMPLATE_TEST_CASE("one instance traced as a PlacedObject has the hits of a tracer of one level", "", FloatLayout,
                   PlanesLayout, HalfLayout, QuantizedLayout) {
  using Flat = WithLayout<TestType>;
  using OneLevel = Instanced<Flat>;
  Random random(kSeed);
  unsigned hits = 0;
  for (unsigned turn = 0; turn < 12; ++turn) {
    const std::uint32_t mask = turn % 3 == 0 ? 2u : 0xffffffffu;
    const InstanceScene scene = scene_of(
        TestType::kId, {{.object = 1}, {.object = 0, .to_scene = random_affine(random, 2.0), .mask = mask, .id = 7}});
    const auto alone = placed(scene);
    REQUIRE(alone);
    for (unsigned i = 0; i < 200; ++i) {
      const auto origin = random.in_cube(4), target = random.in_cube(2);
      Ray ray;
      ray.origin = Vec3(origin[0], origin[1], origin[2]);
      ray.direction = Vec3(target[0], target[1], target[2]) - ray.origin;
      ray.mask = i % 5 == 0 ? 1u : i % 7 == 0 ? 0u : 0xffffffffu;
      INFO("seed " << kSeed << ", turn " << turn << ", ray " << i);
      const auto expected = closest_hit<OneLevel>(scene.view(), ray);
      const Ray local = alone->to_object(ray);
      REQUIRE(same(alone->to_scene(closest_hit<Flat>(alone->object, local), ray), expected));
      const auto any = alone->with_path(any_hit<Flat>(alone->object, local));
      REQUIRE(any.found() == expected.found());
      hits += expected.found() ? 1u : 0u;
    }
  }
  CHECK(hits > 300);
}

TEST_CASE("invalid rays also miss a PlacedObject") {
  const InstanceScene scene = scene_of(NodeLayout::kPlanes, {{.object = 0}});
  const auto alone = placed(scene);
  REQUIRE(alone);
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  for (const Ray& ray : {Ray{.origin = {inf, 0, 0}}, Ray{.origin = {nan, 0, 0}}, Ray{.direction = {0, 0, 0}},
                         Ray{.direction = {inf, 0, 0}}, Ray{.tmin = 2, .tmax = 1}, Ray{.tmax = nan}})
    CHECK_FALSE(alone->to_scene(closest_hit<Policies>(alone->object, alone->to_object(ray)), ray).found());
}

TEST_CASE("only a single static instance of an object without instances is a PlacedObject") {
  CHECK(placed(scene_of(NodeLayout::kPlanes, {{.object = 0}})));
  CHECK_FALSE(placed(scene_of(NodeLayout::kPlanes, {{.object = 0}, {.object = 0}})));
  CHECK_FALSE(placed(scene_of(NodeLayout::kPlanes, {{.object = 1}})));
  const build::Motion motion{.keys = {{.time = 0}, {.time = 1, .translation = {1, 0, 0}}}};
  CHECK_FALSE(placed(scene_of(NodeLayout::kPlanes, {{.object = 0, .motion = &motion}})));
  InstanceScene opened;
  opened.add_file({oracle::icosphere(2)}, NodeLayout::kPlanes);
  opened.groups = {{{.object = 0}}};
  opened.build({.opening_budget = 8.0, .open_largest = true});
  CHECK_FALSE(placed(opened));
  opened.groups = {{{.object = 0}}, {{.object = 1}}};
  opened.build();
  CHECK_FALSE(placed(opened));
  CHECK_FALSE(only_instance(*open_buffer(std::as_const(opened.files[0]).bytes())));
}
