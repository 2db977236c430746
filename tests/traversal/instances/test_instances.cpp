// Scenes of instances: hits do not depend on the top-level trees, with any number of levels.

#include <hiprt_build/format/box.h>
#include <hiprt_build/format/checksum.h>
#include <hiprt_build/format/view.h>
#include <tests/traversal/instances/instance_scenes.h>

#include <algorithm>
#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261122;

template <class LayoutType, unsigned kLevels> struct Tracer : Instanced<WithLayout<LayoutType>, kLevels> {};
template <class LayoutType, unsigned kLevels> struct PostponedTracer : Instanced<WithLayout<LayoutType>, kLevels> {
  using Schedule = Postponed;
};

/// Groups of instances of earlier objects.
InstanceScene random_scene(std::uint64_t seed, NodeLayout layout, unsigned levels, std::uint32_t instances) {
  Random random(seed);
  InstanceScene scene;
  scene.add_file({oracle::icosphere(2)}, layout);
  scene.add_file({oracle::soup(40, 0.5, seed), oracle::torus(12, 8, 0.4)}, layout);
  for (unsigned level = 0; level < levels; ++level) {
    std::vector<Instance> group(instances);
    for (std::uint32_t i = 0; i < instances; ++i) {
      // The group before at least once, so that there are as many levels.
      const auto objects = static_cast<std::uint32_t>(scene.files.size() + level);
      group[i] = {.object = i == 0 ? objects - 1 : random.below(objects),
                  .to_scene = random_affine(random, 3.0),
                  .mask = random.below(6) == 0 ? 2u : 0xffffffffu,
                  .id = 100 * level + i};
    }
    scene.groups.push_back(group);
  }
  return scene;
}

}  // namespace

TEMPLATE_TEST_CASE("hits do not depend on trees over instances, in every layout", "", FloatLayout, PlanesLayout,
                   HalfLayout, QuantizedLayout) {
  for (unsigned levels = 1; levels <= 3; ++levels) {
    InstanceScene scene = random_scene(kSeed + levels, TestType::kId, levels, 9);
    scene.build();
    CHECK(scene.view().levels == levels);
    check_rays<Tracer<TestType, 3>>(scene, kSeed, 400);
    check_rays<PostponedTracer<TestType, 3>>(scene, kSeed + 1, 200);
  }
  InstanceScene scene = random_scene(kSeed, TestType::kId, 1, 30);
  scene.build();
  check_rays<Tracer<TestType, 1>>(scene, kSeed, 600);
  check_rays<PostponedTracer<TestType, 1>>(scene, kSeed, 300);
}

TEST_CASE("hits do not depend on the bounds of instances or the builder of their tree") {
  for (const auto bounds : {build::InstanceBounds::kRoot, build::InstanceBounds::kChildren,
                            build::InstanceBounds::kGrandchildren, build::InstanceBounds::kPrimitives})
    for (const auto builder : {build::Builder::kSah, build::Builder::kLbvh, build::Builder::kHploc}) {
      InstanceScene scene = random_scene(kSeed, NodeLayout::kPlanes, 2, 12);
      scene.build({.tree = {.builder = builder}, .bounds = bounds});
      check_rays<Tracer<PlanesLayout, 2>>(scene, kSeed, 300);
    }
}

TEST_CASE("boxes from primitives contain all corners and are tight") {
  InstanceScene scene;
  const oracle::Mesh mesh = oracle::soup(300, 0.3, kSeed);
  scene.add_file({mesh}, NodeLayout::kPlanes);
  Random random(kSeed);
  scene.groups.emplace_back();
  for (unsigned i = 0; i < 60; ++i) scene.groups[0].push_back({.to_scene = random_affine(random, 3.0)});
  scene.build({.bounds = build::InstanceBounds::kPrimitives});
  const BufferView view = *open_buffer(scene.file.bytes());
  for (const CustomLeaf& leaf : view.records<CustomLeaf>(view.leaves)) {
    CAPTURE(leaf.info.primitive[0]);
    const StillInstanceBounds to_scene(view.instances[leaf.info.primitive[0]]);
    Box all = format_detail::empty_box();
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t corner : triangle) {
        const auto& p = mesh.positions[corner];
        format_detail::grow(all, to_scene.bounds({{p[0], p[1], p[2]}, {p[0], p[1], p[2]}}));
      }
    for (unsigned axis = 0; axis < 3; ++axis) {
      // Parts of triangles end at boxes, which are rounded.
      const float slack = 0x1p-20f * (all.max[axis] - all.min[axis]);
      CHECK(std::fabs(leaf.box[0].min[axis] - all.min[axis]) <= slack);
      CHECK(std::fabs(leaf.box[0].max[axis] - all.max[axis]) <= slack);
    }
  }
}

TEST_CASE("opened scenes do not depend on the number of threads") {
  InstanceScene one = random_scene(kSeed, NodeLayout::kPlanes, 1, 100),
                many = random_scene(kSeed, NodeLayout::kPlanes, 1, 100);
  one.build({.tree = {.threads = 1}, .opening_budget = 8.0, .open_largest = true});
  many.build({.tree = {.threads = 5}, .opening_budget = 8.0, .open_largest = true});
  const auto a = std::as_const(one.file).bytes(), b = std::as_const(many.file).bytes();
  CHECK(std::equal(a.begin(), a.end(), b.begin(), b.end()));
  CHECK(open_buffer(a)->leaves.count > 700);
}

TEST_CASE("the result of validate() does not depend on the order of its loop bodies") {
  InstanceScene scene;
  scene.add_file({oracle::icosphere(0)}, NodeLayout::kPlanes);
  scene.groups.emplace_back(5000);
  Random random(kSeed);
  for (Instance& instance : scene.groups[0]) instance.to_scene = random_affine(random, 100.0);
  scene.build();
  const auto bytes = std::as_const(scene.file).bytes();
  const auto backwards = [](std::size_t count, const std::function<void(std::size_t)>& body) {
    CHECK(count > 3);
    while (count-- > 0) body(count);
  };
  REQUIRE(validate(bytes, backwards));
  CHECK(validate(bytes, backwards)->stack_need == validate(bytes)->stack_need);
  const BufferView view = *open_buffer(bytes);
  auto* leaves = reinterpret_cast<CustomLeaf*>(scene.file.bytes().data() + view.leaves.offset);
  for (const std::size_t bad : {4000u, 1500u}) leaves[bad].box[0].max[1] = leaves[bad].box[0].min[1];
  reinterpret_cast<FileHeader*>(scene.file.bytes().data())->checksum = file_checksum(bytes);
  const auto issue = validate(bytes), issue_backwards = validate(bytes, backwards);
  REQUIRE_FALSE(issue);
  REQUIRE_FALSE(issue_backwards);
  CHECK(issue.error().error == FormatError::kBoxNotContained);
  CHECK(to_string(issue.error()) == to_string(issue_backwards.error()));
  CHECK((issue.error().offset - view.leaves.offset) / sizeof(CustomLeaf) == 1500);
}

TEST_CASE("sixteen levels") {
  InstanceScene scene = random_scene(kSeed, NodeLayout::kPlanes, kMostLevels, 2);
  scene.build();
  CHECK(scene.view().levels == kMostLevels);
  CHECK_FALSE(covers<Tracer<PlanesLayout, kMostLevels - 1>>(scene.view()));
  CHECK(closest_hit<Tracer<PlanesLayout, kMostLevels - 1>>(scene.view(), Ray{}).failed());
  CHECK_FALSE(covers<Policies>(scene.view()));
}

TEST_CASE("invalid transforms are refused with their numbers") {
  const auto message_of = [](const Affine& transform) {
    InstanceScene scene;
    scene.add_file({oracle::icosphere(1)}, NodeLayout::kPlanes);
    scene.groups.push_back({{}, {.to_scene = transform}});
    const auto bvh = scene.try_build();
    if (bvh) return std::string();
    CHECK(bvh.error().code == build::ErrorCode::kInvalidInput);
    return bvh.error().message;
  };
  const auto diagonal = [](float x, float y, float z) { return Affine{{{x, 0, 0, 0}, {0, y, 0, 0}, {0, 0, z, 0}}}; };
  const float inf = std::numeric_limits<float>::infinity();
  CHECK(message_of(diagonal(1, 1, 0)) ==
        "group 0, instance 1: the transform has no inverse that floats can hold: determinant 0");
  CHECK(message_of(diagonal(1, 1, 1e-39f)).find("determinant 1e-39") != std::string::npos);
  CHECK(message_of({{{1, 2, 3, 0}, {4, 5, 6, 0}, {7, 8, 9, 0}}}).find("determinant 0") != std::string::npos);
  CHECK(message_of(diagonal(1, inf, 1)) == "group 0, instance 1: the transform is not finite");
  Affine moved;
  moved.row[2][3] = std::numeric_limits<float>::quiet_NaN();
  CHECK(message_of(moved) == "group 0, instance 1: the transform is not finite");
  // Small, large, mirrored, flat, sheared: all work.
  CHECK(message_of(diagonal(1e-10f, 1e-10f, 1e-10f)) == "");
  CHECK(message_of(diagonal(1e12f, 1e12f, 1e12f)) == "");
  CHECK(message_of(diagonal(-1, 1, 1)) == "");
  CHECK(message_of(diagonal(1, 1, 1e-6f)) == "");
  CHECK(message_of({{{1, 1000, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}}) == "");
}

TEST_CASE("invalid scenes of instances are refused") {
  InstanceScene scene;
  const auto message = [&] {
    const auto bvh = scene.try_build();
    return bvh ? std::string() : bvh.error().message;
  };
  CHECK(message() == "a scene of instances has a group at least");
  scene.groups = {{{.object = 0}}};
  CHECK(message() == "group 0, instance 0: object 0, those before the group are 0");
  scene.add_file({oracle::icosphere(1)}, NodeLayout::kPlanes);
  scene.add_file({oracle::icosphere(1)}, NodeLayout::kFloat);
  CHECK(message() == "file 1: layout 1, that of file 0 is 2");
  scene.files.pop_back();
  scene.groups = {{{.object = 1}}};
  CHECK(message() == "group 0, instance 0: object 1, those before the group are 1");
  scene.groups = {{{.object = 0}}};
  scene.build();
  scene.files[0] = std::move(scene.file);
  CHECK(message() == "file 0: has instances itself: give its objects and groups in place of it");
}

TEST_CASE("empty scenes of instances") {
  InstanceScene scene;
  scene.add_file({}, NodeLayout::kPlanes);
  scene.groups = {{}, {{.object = 0}, {.object = 1}}};
  scene.build();
  CHECK_FALSE(closest_hit<Tracer<PlanesLayout, 2>>(scene.view(), Ray{}).found());
  CHECK_FALSE(closest_hit<Tracer<PlanesLayout, 2>>(scene.view(), Ray{}).failed());
  scene.files.clear();
  scene.groups = {{}};
  scene.build();
  CHECK_FALSE(closest_hit<Tracer<PlanesLayout, 1>>(scene.view(), Ray{}).found());
}

TEST_CASE("all hits of a ray through instances, each once") {
  const InstanceScene scene = [] {
    InstanceScene made = random_scene(kSeed, NodeLayout::kPlanes, 2, 6);
    made.build();
    return made;
  }();
  using P = Tracer<PlanesLayout, 2>;
  const SceneView view = scene.view();
  Random random(kSeed);
  std::size_t most = 0;
  for (unsigned i = 0; i < 300; ++i) {
    const Ray ray = random_ray(random, 6.0);
    P::Stack::Memory memory, other;
    AllHits<P> all(view, ray, P::Stack::Storage(memory));
    ClosestHit<P> closest(view, ray, P::Stack::Storage(other));
    std::vector<PathHit<2>> in_any_order, in_order;
    for (auto hit = all.next_hit(); hit.found(); hit = all.next_hit()) in_any_order.push_back(hit);
    for (auto hit = closest.next_hit(); hit.found(); hit = closest.next_hit()) in_order.push_back(hit);
    REQUIRE(in_any_order.size() == in_order.size());
    most = std::max(most, in_order.size());
    const auto before = [](const PathHit<2>& a, const PathHit<2>& b) {
      if (a.t != b.t) return a.t < b.t;
      if (!(a.path == b.path)) return a.path < b.path;
      return std::pair(a.geometry, a.primitive) < std::pair(b.geometry, b.primitive);
    };
    std::sort(in_any_order.begin(), in_any_order.end(), before);
    for (std::size_t k = 0; k < in_order.size(); ++k) {
      REQUIRE(in_any_order[k].t == in_order[k].t);
      REQUIRE(in_any_order[k].path == in_order[k].path);
      REQUIRE(in_any_order[k].primitive == in_order[k].primitive);
      if (k > 0) REQUIRE(before(in_order[k - 1], in_order[k]));
    }
  }
  CHECK(most > 5);
}

TEST_CASE("builds of scenes report progress, can be cancelled, and are reproducible") {
  const InstanceScene scene = random_scene(kSeed, NodeLayout::kPlanes, 3, 400);
  std::vector<double> fractions;
  build::InstanceOptions options;
  options.tree.progress = [&](const build::Progress& progress) {
    fractions.push_back(progress.fraction);
    return true;
  };
  const auto first = scene.try_build(options), second = scene.try_build({});
  REQUIRE(first.has_value());
  REQUIRE(second.has_value());
  CHECK(std::equal(first->buffer.bytes().begin(), first->buffer.bytes().end(), second->buffer.bytes().begin(),
                   second->buffer.bytes().end()));
  CHECK(std::is_sorted(fractions.begin(), fractions.end()));
  REQUIRE_FALSE(fractions.empty());
  CHECK((fractions.back() > 0.95 && fractions.back() <= 1));
  CHECK(first->statistics.customs == 400);
  for (const unsigned calls : {0u, 3u, 10u}) {
    unsigned left = calls;
    options.tree.progress = [&](const build::Progress&) { return left-- > 0; };
    const auto cancelled = scene.try_build(options);
    if (!cancelled) CHECK(cancelled.error().code == build::ErrorCode::kCancelled);
  }
  options.tree.progress = [](const build::Progress&) { return false; };
  REQUIRE_FALSE(scene.try_build(options).has_value());
}

TEST_CASE("bounds beyond floats are refused") {
  InstanceScene scene;
  scene.add_file({oracle::placed(oracle::icosphere(1), 1e30)}, NodeLayout::kPlanes);
  scene.groups = {{{.to_scene = {{{1e12f, 0, 0, 0}, {0, 1e12f, 0, 0}, {0, 0, 1e12f, 0}}}}}};
  const auto bvh = scene.try_build();
  REQUIRE_FALSE(bvh.has_value());
  CHECK(bvh.error().message == "group 0, instance 0: its bounds are beyond what floats hold");
}

TEST_CASE("an identity instance has the hits of its object, also with extreme coordinates") {
  INFO("seed " << kSeed);
  InstanceScene scene;
  scene.add_file({oracle::torture(2000, kSeed), oracle::needles(500, 1e6, kSeed)}, NodeLayout::kPlanes);
  scene.groups = {{{}}};
  scene.build();
  const SceneView flat = make_scene_view(*open_buffer(scene.files[0].bytes())), view = scene.view();
  Random random(kSeed);
  unsigned hits = 0;
  for (unsigned i = 0; i < 4000; ++i) {
    Ray ray = random_ray(random, 2.0);
    ray.direction *= static_cast<float>(random.log_uniform(1e-20, 1e20));
    ray.tmax = std::numeric_limits<float>::infinity();
    const Hit expected = closest_hit<Policies>(flat, ray);
    const auto hit = closest_hit<Tracer<PlanesLayout, 1>>(view, ray);
    INFO("ray " << i);
    REQUIRE(hit.found() == expected.found());
    REQUIRE((!hit.found() || (hit.t == expected.t && hit.primitive == expected.primitive)));
    hits += hit.found() ? 1 : 0;
  }
  CHECK(hits > 100);
}
