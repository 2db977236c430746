// Opened instances: the same hits and instance paths with any number of leaves per instance. Also the flags of
// instances.

#include <hiprt_build/format/checksum.h>
#include <hiprt_build/format/view.h>
#include <tests/traversal/moving_scenes.h>

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

struct RejectAll {
  HIPRT_HD FilterResult operator()(const Ray&, const Hit&) const { return FilterResult::kReject; }
};

}  // namespace

TEMPLATE_TEST_CASE("opened instances give the same hits, each once", "", FloatLayout, PlanesLayout, HalfLayout,
                   QuantizedLayout) {
  for (const unsigned levels : {1u, 2u}) {
    OverlappingScene closed(TestType::kId, levels), opened(TestType::kId, levels);
    closed.build();
    opened.build({.opening_budget = 6.0});
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

TEST_CASE("opening budgets are numbers from 1 to 64") {
  OverlappingScene scene(NodeLayout::kPlanes, 1);
  for (const double budget : {0.5, 65.0, std::numeric_limits<double>::quiet_NaN()})
    CHECK(scene.try_build({.opening_budget = budget}).error().message.find("opening_budget is ") == 0);
}

TEST_CASE("a file whose leaves lead to one part twice, or not to all parts, is refused") {
  OverlappingScene scene(NodeLayout::kPlanes, 1);
  scene.build({.opening_budget = 4.0});
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
