// Opened instances: the same hits and instance paths with any number of leaves per instance. Also the flags of
// instances.

#include <hiprt_build/format/checksum.h>
#include <hiprt_build/format/view.h>
#include <tests/traversal/instances/moving_scenes.h>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261126;

/// Instances that lie in each other, of objects with split triangles too; groups of groups.
struct OverlappingScene : InstanceScene {
  build::Motion motion{.keys = {{.time = 0}, {.time = 1, .translation = {1, 0, 0}, .rotation = {0, 0, 1, 1}}}};

  OverlappingScene(NodeLayout layout, unsigned levels) {
    Random random(kSeed);
    add_file({oracle::icosphere(3)}, layout);
    const std::vector<oracle::Mesh> needles{oracle::needles(60, 20, kSeed)};
    auto split =
        build::build(oracle::views(needles), {.builder = build::Builder::kSbvh, .nodes = layout, .split_budget = 3.0});
    REQUIRE(split.has_value());
    files.push_back(std::move(split->buffer));
    for (unsigned level = 0; level < levels; ++level) {
      groups.emplace_back(8);
      for (Instance& instance : groups.back()) {
        instance = {.object = random.below(static_cast<std::uint32_t>(2 + level)),
                    .to_scene = random_affine(random, 0.5)};
        if (random.below(4) == 0) instance.motion = &motion;
      }
      if (level > 0) groups.back()[0].object = 1 + level;
    }
  }
};

template <class P> std::vector<PathHit<P::kLevels>> all_hits(const SceneView& scene, const Ray& ray) {
  typename P::Stack::Memory memory;
  AllHits<P> query(scene, ray, typename P::Stack::Storage(memory));
  std::vector<PathHit<P::kLevels>> hits;
  for (auto hit = query.next_hit(); hit.found(); hit = query.next_hit()) hits.push_back(hit);
  std::sort(hits.begin(), hits.end(), [](const auto& a, const auto& b) {
    if (a.t != b.t) return a.t < b.t;
    if (!(a.path == b.path)) return a.path < b.path;
    return std::pair(a.geometry, a.primitive) < std::pair(b.geometry, b.primitive);
  });
  return hits;
}

struct Counted : Instanced<Policies, 1> {
  using Counter = WorkCounter;
};

/// One object in many places.
struct PlacedScene : InstanceScene {
  explicit PlacedScene(const oracle::Mesh& object) {
    add_file({object}, NodeLayout::kPlanes);
    groups.emplace_back();
  }
  void place(double x, double y, double z, double turn = 0.0, std::uint32_t object = 0) {
    const auto c = static_cast<float>(std::cos(turn)), s = static_cast<float>(std::sin(turn));
    groups[0].push_back(
        {.object = object,
         .to_scene = {
             {{c, 0, s, static_cast<float>(x)}, {0, 1, 0, static_cast<float>(y)}, {-s, 0, c, static_cast<float>(z)}}}});
  }
  std::uint64_t leaves() const { return open_buffer(file.bytes())->leaves.count; }
};

/// Box nodes and leaves that rays visit, and four for each instance that they enter: about its cost on GPUs. Half of
/// the rays cross the scene; the others start at their hits.
double cost_of_rays(const PlacedScene& scene) {
  const SceneView view = scene.view();
  Random random(kSeed);
  WorkCounter counter;
  Counted::Stack::Memory memory;
  const auto trace = [&](const Ray& ray) {
    ClosestHit<Counted> query(view, ray, Counted::Stack::Storage(memory), {}, {}, counter);
    const auto hit = query.next_hit();
    counter = query.counter();
    return hit;
  };
  for (unsigned i = 0; i < 2000; ++i) {
    float from[3], to[3];
    for (unsigned axis = 0; axis < 3; ++axis) {
      const double low = view.bounds.min[axis], size = view.bounds.max[axis] - low;
      from[axis] = static_cast<float>(low + size * random.uniform(-0.2, 1.2));
      to[axis] = static_cast<float>(low + size * random.uniform(0.0, 1.0));
    }
    const Vec3 direction{to[0] - from[0], to[1] - from[1], to[2] - from[2]};
    const auto hit = trace({{from[0], from[1], from[2]}, 0, direction});
    if (!hit.found()) continue;
    const oracle::Double3 away = random.on_sphere();
    const Vec3 next{static_cast<float>(away[0]), static_cast<float>(away[1]), static_cast<float>(away[2])};
    trace({spawn_origin({{from[0], from[1], from[2]}, 0, direction}, hit, next), 0, next});
  }
  return counter.box_tests + counter.leaf_tests + 4.0 * counter.instance_tests;
}

struct RejectAll {
  HIPRT_HD FilterResult operator()(const Ray&, const Hit&) const { return FilterResult::kReject; }
};

}  // namespace

TEMPLATE_TEST_CASE("opened instances give the same hits, each once", "", FloatLayout, PlanesLayout, HalfLayout,
                   QuantizedLayout) {
  for (const unsigned levels : {1u, 2u}) {
    OverlappingScene closed(TestType::kId, levels), opened(TestType::kId, levels);
    closed.build();
    opened.build({.opening_budget = 6.0, .open_largest = true});
    const SceneView a = closed.view(), b = opened.view();
    const auto leaves = [](const InstanceScene& scene) { return open_buffer(scene.file.bytes())->leaves.count; };
    CHECK(leaves(closed) == 8);
    CHECK(leaves(opened) > 40);
    CHECK(open_buffer(opened.file.bytes())->instances.size() == 8);
    using P = Moving<Instanced<WithLayout<TestType>, 2>>;
    Random random(kSeed);
    unsigned hits = 0;
    for (unsigned i = 0; i < 300; ++i) {
      const Ray ray = random_ray(random, 6.0);
      const auto first = closest_hit<P>(a, ray), second = closest_hit<P>(b, ray);
      INFO("seed " << kSeed << ", ray " << i << ", levels " << levels);
      REQUIRE((first.t == second.t && first.path == second.path && first.primitive == second.primitive));
      REQUIRE((first.normal == second.normal && first.error == second.error));
      const auto all = all_hits<P>(a, ray), all_of_opened = all_hits<P>(b, ray);
      REQUIRE(all.size() == all_of_opened.size());
      hits += static_cast<unsigned>(all.size());
      for (std::size_t k = 0; k < all.size(); ++k)
        REQUIRE((all[k].t == all_of_opened[k].t && all[k].path == all_of_opened[k].path &&
                 all[k].primitive == all_of_opened[k].primitive));
    }
    CHECK(hits > 300);
  }
}

TEST_CASE("instances are opened where rays gain, and nowhere else") {
  PlacedScene apart(oracle::soup(380, 0.3, kSeed)), together(oracle::soup(380, 0.3, kSeed));
  oracle::Mesh spheres;
  for (const oracle::Double3& at : {oracle::Double3{-3, 0, 0}, {0, 2, 3}, {3, -2, 0}})
    oracle::append(spheres, oracle::placed(oracle::icosphere(2), 0.2, at));
  PlacedScene pieces(spheres);
  PlacedScene town(oracle::subdivided_box(5, 1.0, kSeed)), forest(oracle::icosphere(2));
  for (PlacedScene* scene : {&town, &forest})
    scene->add_file({oracle::placed(oracle::grid_plane(40, 1, 0.0f), 20.0)}, NodeLayout::kPlanes);
  Random random(kSeed);
  for (int x = 0; x < 12; ++x)
    for (int z = 0; z < 12; ++z) {
      apart.place(4.0 * x, 0, 4.0 * z, random.uniform(0, 6.28));
      together.place(0.8 * x, 0, 0.8 * z, random.uniform(0, 6.28));
      pieces.place(0.7 * x, 0, 0.7 * z, random.uniform(0, 6.28));
      town.place(3.0 * x - 18, 1, 3.0 * z - 18, random.uniform(-0.1, 0.1));
      forest.place(random.uniform(-18, 18), 0.7, random.uniform(-18, 18));
    }
  for (PlacedScene* scene : {&town, &forest}) scene->place(0, 0, 0, 0, 1);
  struct {
    const char* name;
    PlacedScene& scene;
    double most;  ///< Cost when opened, relative to closed.
  } scenes[]{{"soups apart", apart, 1.0},
             {"soups in each other", together, 1.0},
             {"three pieces each", pieces, 0.7},
             {"town", town, 1.02},
             {"forest", forest, 1.02}};
  for (auto& [name, scene, most] : scenes) {
    scene.build();
    const std::uint64_t closed_leaves = scene.leaves();
    const double closed = cost_of_rays(scene);
    for (const double budget : {2.0, 4.0, 16.0}) {
      scene.build({.opening_budget = budget});
      const double ratio = cost_of_rays(scene) / closed;
      INFO("seed " << kSeed << ", " << name << ", budget " << budget << ": " << closed_leaves << " leaves become "
                   << scene.leaves() << ", cost " << ratio);
      CHECK(ratio <= most);
      CHECK(static_cast<double>(scene.leaves()) <= budget * static_cast<double>(closed_leaves));
      if (&scene == &apart || &scene == &together) CHECK(scene.leaves() == closed_leaves);
    }
  }
}

TEST_CASE("opening budgets are numbers from 1 to 64") {
  OverlappingScene scene(NodeLayout::kPlanes, 1);
  for (const double budget : {0.5, 65.0, std::numeric_limits<double>::quiet_NaN()})
    CHECK(scene.try_build({.opening_budget = budget}).error().message.find("opening_budget is ") == 0);
}

TEST_CASE("a file whose leaves lead to one part twice, or not to all parts, is refused") {
  OverlappingScene scene(NodeLayout::kPlanes, 1);
  scene.build({.opening_budget = 4.0, .open_largest = true});
  const BufferView view = *open_buffer(scene.file.bytes());
  auto* leaves = reinterpret_cast<CustomLeaf*>(scene.file.bytes().data() + view.leaves.offset);
  auto& header = *reinterpret_cast<FileHeader*>(scene.file.bytes().data());
  std::size_t one = 0, other = 0;
  for (std::size_t i = 0; i < view.leaves.count; ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (leaves[i].info.primitive[0] == leaves[k].info.primitive[0]) one = k, other = i;
  REQUIRE(one != other);
  leaves[one] = leaves[other];
  header.checksum = file_checksum(std::as_const(scene.file).bytes());
  const auto summary = validate(std::as_const(scene.file).bytes());
  REQUIRE_FALSE(summary.has_value());
}

TEST_CASE("filters are not called for instances with without_filter") {
  OverlappingScene scene(NodeLayout::kPlanes, 2);
  for (Instance& instance : scene.groups[1]) instance.without_filter = instance.object == 0;
  scene.build();
  using P = Moving<Instanced<Policies, 2>>;
  const SceneView view = scene.view();
  Random random(kSeed);
  unsigned hits = 0;
  for (unsigned i = 0; i < 300; ++i) {
    const Ray ray = random_ray(random, 6.0);
    P::Stack::Memory memory;
    const auto hit = ClosestHit<P, RejectAll>(view, ray, P::Stack::Storage(memory)).next_hit();
    if (!hit.found()) continue;
    ++hits;
    REQUIRE(scene.groups[1][hit.path.instance[0]].without_filter);
  }
  CHECK(hits > 50);
}
