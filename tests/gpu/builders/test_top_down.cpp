// Top-down trees on the device: complete, and as cheap as the host's.

#include <hiprt_build/exec/lane_group.h>
#include <hiprt_build/gpu/device_buffer.h>
#include <hiprt_build/input/build_input.h>
#include <hiprt_build/input/references.h>
#include <hiprt_build/pair/pair_window.h>
#include <hiprt_build/sah_sbvh/gpu_top_down.h>
#include <hiprt_build/sah_sbvh/sah.h>
#include <hiprt_build/sah_sbvh/sbvh.h>
#include <tests/build/machine.h>
#include <tests/gpu/counting_allocator.h>
#include <tests/gpu/results.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <cstdio>
#include <cstring>
#include <map>
#include <memory>

using namespace hiprt;
using namespace hiprt::checks;
using build::kLinkedLeaf;
using build::LinkedNode;
using build::LinkedRef;
using build::Reference;

namespace {

constexpr std::uint64_t kSeed = 20261122;

/// Splits that cut nothing are not tried, or tried.
constexpr build::SplitRules kRules{1e-5f, 0.0f}, kWholeRules{1e-5f, 0.9f};
/// Sizes that take small inputs through everything that large ones meet.
constexpr gpu::TopDownTuning kTiny{.task = 96, .wave_range = 40, .spare_levels = 6};

/// A mesh whose leaves are known, as both the device and the host take it.
struct Scene {
  oracle::Mesh mesh;
  std::vector<Reference>
      references;  ///< With unused entries for the second triangles of pairs and for dropped triangles.
  std::vector<build::LeafPrimitives> leaves;

  explicit Scene(oracle::Mesh from, bool pair = true) : mesh(std::move(from)) {
    const auto views = views_of(mesh.positions.data(), mesh.triangles.data());
    const auto primitives = static_cast<std::uint32_t>(mesh.triangles.size());
    const build::PairWindow<build::HostGroup> windows{{views.data(), 2, primitives}, pair};
    auto shared = std::make_unique<build::PairWindow<build::HostGroup>::Shared>();
    for (std::uint32_t w = 0; w * build::kPairWindow < primitives; ++w)
      windows(build::HostGroup{}, *shared, w, [&](const build::PairedPrimitive& p) {
        references.push_back(Reference{p.box, p.contents, p.primitive});
        if (p.contents.exists()) leaves.push_back({p.primitive, p.contents});
      });
  }

  /// Two geometries that share the mesh's positions.
  std::vector<build::GeometryView> views_of(const build::Position* positions, const build::Triangle* triangles) const {
    const auto all = static_cast<std::uint32_t>(mesh.triangles.size()), first = all / 3;
    const auto view = [&](std::uint32_t begin, std::uint32_t end) {
      return build::GeometryView::of_mesh(positions, static_cast<std::uint32_t>(mesh.positions.size()),
                                          sizeof(build::Position), triangles + begin, end - begin,
                                          sizeof(build::Triangle));
    };
    std::vector<build::GeometryView> views{view(0, first), view(first, all)};
    views[1].first = first;
    return views;
  }
};

struct Outcome {
  std::vector<Reference> references;
  std::vector<LinkedNode> nodes;
  LinkedRef root = 0;
  std::uint32_t leaves = 0;

  bool same_bytes(const Outcome& other) const {
    return root == other.root && leaves == other.leaves && nodes.size() == other.nodes.size() &&
           std::memcmp(nodes.data(), other.nodes.data(), nodes.size() * sizeof(LinkedNode)) == 0 &&
           std::memcmp(references.data(), other.references.data(), references.size() * sizeof(Reference)) == 0;
  }
};

/// Scratch memory and output hold @p garbage at first.
Outcome build_on_device(const Scene& scene, double budget, bool spatial, const gpu::TopDownTuning& tuning,
                        std::byte garbage = std::byte{0xa5}, gpu::LongStep asks = {},
                        const build::SplitRules& rules = kRules) {
  CountingAllocator allocator;
  const auto n = static_cast<std::uint32_t>(scene.references.size());
  const auto capacity = static_cast<std::uint32_t>(build::split_capacity(n, spatial ? budget : 1.0));
  const std::uint64_t bytes = gpu::top_down_scratch(n, capacity, tuning, rules);
  constexpr std::size_t kGuard = 4096;
  auto positions = must(gpu::DeviceArray<build::Position>::from(scene.mesh.positions, nullptr, allocator));
  auto triangles = must(gpu::DeviceArray<build::Triangle>::from(scene.mesh.triangles, nullptr, allocator));
  const auto host_views = scene.views_of(positions.data(), triangles.data());
  auto views = must(gpu::DeviceArray<build::GeometryView>::from(host_views, nullptr, allocator));
  auto input = must(gpu::DeviceArray<Reference>::from(scene.references, nullptr, allocator));
  auto references = must(gpu::DeviceArray<Reference>::make(capacity, nullptr, allocator));
  auto nodes = must(gpu::DeviceArray<LinkedNode>::make(capacity, nullptr, allocator));
  auto results = must(gpu::DeviceArray<std::uint32_t>::make(2, nullptr, allocator));
  auto scratch = must(gpu::DeviceArray<std::byte>::make(bytes + kGuard, nullptr, allocator));
  must(references.fill(garbage, nullptr));
  must(nodes.fill(garbage, nullptr));
  must(results.fill(garbage, nullptr));
  must(scratch.fill(garbage, nullptr));
  must(gpu::enqueue_top_down({{views.data(), 2, n}, input.data(), n, capacity, budget, spatial, rules},
                             {references.data(), nodes.data(), results.data(), results.data() + 1}, scratch.data(),
                             nullptr, tuning, asks));
  REQUIRE(hipDeviceSynchronize() == hipSuccess);
  Outcome outcome;
  outcome.references = must(references.to_vector(nullptr));
  outcome.nodes = must(nodes.to_vector(nullptr));
  const auto words = must(results.to_vector(nullptr));
  outcome.root = words[0];
  outcome.leaves = words[1];
  const auto after = must(scratch.to_vector(nullptr));
  CHECK(std::count(after.end() - kGuard, after.end(), garbage) == kGuard);
  return outcome;
}

bool same_box(const Box& a, const Box& b) {
  return std::equal(a.min, a.min + 3, b.min) && std::equal(a.max, a.max + 3, b.max);
}
double half_area(const Box& box) {
  const double x = double{box.max[0]} - double{box.min[0]}, y = double{box.max[1]} - double{box.min[1]},
               z = double{box.max[2]} - double{box.min[2]};
  return x * y + y * z + z * x;
}

/// Walks a tree and checks that every leaf and every node is in it once.
class Walk {
 public:
  explicit Walk(const Outcome& outcome)
      : outcome_(outcome), nodes_(outcome.nodes.size()), leaves_(outcome.nodes.size()) {
    if (outcome.root != kInvalidId) enter(outcome.root, 0);
    std::size_t unused_nodes = 0, unused_leaves = 0, wrong = 0;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      unused_nodes += nodes_[i] == 0 ? 1 : 0;
      unused_leaves += leaves_[i] == 0 ? 1 : 0;
      wrong += (nodes_[i] == 0) != (outcome.nodes[i].child[0] == kInvalidId) || nodes_[i] > 1 || leaves_[i] > 1 ||
               (leaves_[i] != 0) != outcome.references[i].contents.exists();
    }
    CHECK(wrong == 0);
    CHECK(wrong_boxes_ == 0);
    CHECK(nodes_.size() - unused_leaves == outcome.leaves);
    if (outcome.leaves > 0) CHECK(nodes_.size() - unused_nodes + 1 == outcome.leaves);
  }
  double cost() const { return cost_; }  ///< Sum of half areas.
  unsigned depth() const { return depth_; }

 private:
  Box enter(LinkedRef ref, unsigned depth) {
    depth_ = std::max(depth_, depth);
    const std::uint32_t number = ref & ~kLinkedLeaf;
    REQUIRE(number < nodes_.size());
    if ((ref & kLinkedLeaf) != 0) {
      REQUIRE(++leaves_[number] == 1);
      cost_ += half_area(outcome_.references[number].box);
      return outcome_.references[number].box;
    }
    REQUIRE(++nodes_[number] == 1);
    const LinkedNode& node = outcome_.nodes[number];
    REQUIRE(depth < 64);
    const Box left = enter(node.child[0], depth + 1), right = enter(node.child[1], depth + 1);
    const Box both = build::unite(left, right);
    // A range's box is of its references before two parts of one become one leaf: that is the same box.
    wrong_boxes_ += same_box(both, node.box) ? 0 : 1;
    cost_ += half_area(node.box);
    return node.box;
  }

  const Outcome& outcome_;
  std::vector<unsigned> nodes_, leaves_;
  double cost_ = 0;
  unsigned depth_ = 0;
  std::size_t wrong_boxes_ = 0;
};

/// Points of a leaf's triangles are in one of its references' boxes.
void check_covered(const Scene& scene, const Outcome& outcome) {
  std::map<std::uint32_t, std::vector<Box>> parts;
  std::map<std::uint32_t, std::uint32_t> bits;
  for (const Reference& r : scene.references)
    if (r.contents.exists()) bits[r.primitive] = r.contents.bits;
  for (const Reference& r : outcome.references) {
    if (!r.contents.exists()) continue;
    REQUIRE(bits.count(r.primitive) == 1);
    REQUIRE(bits[r.primitive] == r.contents.bits);
    parts[r.primitive].push_back(r.box);
  }
  std::size_t missing = 0;
  for (const build::LeafPrimitives& leaf : scene.leaves)
    for (unsigned which = 0; which < (leaf.contents.is_pair() ? 2u : 1u); ++which) {
      const std::uint32_t primitive = leaf.primitive + which * leaf.contents.distance();
      const build::Triangle& t = scene.mesh.triangles[primitive];
      for (unsigned i = 0; i <= 8; ++i)
        for (unsigned j = 0; i + j <= 8; ++j) {
          double p[3];
          for (std::size_t k = 0; k < 3; ++k)
            p[k] = (double{scene.mesh.positions[t[0]][k]} * i + double{scene.mesh.positions[t[1]][k]} * j +
                    double{scene.mesh.positions[t[2]][k]} * (8 - i - j)) /
                   8;
          const auto& boxes = parts[leaf.primitive];
          missing += std::none_of(boxes.begin(), boxes.end(), [&](const Box& box) {
            bool inside = true;
            for (unsigned k = 0; k < 3; ++k) inside = inside && p[k] >= box.min[k] && p[k] <= box.max[k];
            return inside;
          });
        }
    }
  CHECK(missing == 0);
}

double cost_on_host(const Scene& scene, double budget, bool spatial, const build::SplitRules& rules,
                    std::size_t& leaves) {
  build::Machine machine;
  const build::TriangleMesh view = scene.mesh.view();
  const build::BuildInput input(build::SceneInput{{&view, 1}, {}});
  const build::GeometryTable table = input.table();
  auto references = machine.engine.allocate<build::Reference>(scene.leaves.size());
  for (std::size_t i = 0; i < scene.leaves.size(); ++i)
    build::MakeReferenceStep{table, scene.leaves, references.span()}(i);
  const build::DepthFirstTree tree =
      spatial ? build::build_sbvh(machine.engine, table, std::move(references), budget, rules)
              : build::build_sah(machine.engine, std::move(references));
  double cost = 0;
  leaves = tree.references.size();
  for (const build::DepthFirstNode& node : tree.nodes.span()) cost += half_area(node.box);
  return cost;
}

/// The tree's cost relative to the host's.
double check_tree(const Scene& scene, double budget, const gpu::TopDownTuning& tuning, const char* name,
                  const build::SplitRules& rules = kRules) {
  const bool spatial = budget > 1.0;
  INFO(name << ", " << scene.leaves.size() << " references, budget " << budget << ", wave_range " << tuning.wave_range
            << ", whole_share " << rules.whole_share);
  const Outcome outcome = build_on_device(scene, budget, spatial, tuning, std::byte{0xa5}, {}, rules);
  CHECK(outcome.same_bytes(build_on_device(scene, budget, spatial, tuning, std::byte{0x3c}, {}, rules)));
  const Walk walk(outcome);
  CHECK(walk.depth() <= build::kMaxDepth);
  if (scene.leaves.empty()) CHECK(outcome.root == kInvalidId);
  CHECK(outcome.leaves >= scene.leaves.size());
  CHECK(outcome.leaves <= build::split_capacity(scene.leaves.size(), budget));
  check_covered(scene, outcome);
  if (!spatial) CHECK(outcome.leaves == scene.leaves.size());
  std::size_t host_leaves = 0;
  const double host = cost_on_host(scene, budget, spatial, rules, host_leaves),
               relative = host > 0 ? walk.cost() / host : 1.0;
  std::printf(
      "%-12s %5zu references, budget %.1f, wave_range %3u: %5u leaves (host %5zu), depth %2u, cost / host's %.4f\n",
      name, scene.leaves.size(), budget, tuning.wave_range, outcome.leaves, host_leaves, walk.depth(), relative);
  return relative;
}

}  // namespace

TEST_CASE("top-down trees of wave_range references") {
  INFO("seed " << kSeed);
  for (const unsigned count : {0u, 1u, 2u, 3u, 8u, 9u, 32u, 33u, 40u, 41u, 97u}) {
    const Scene scene(oracle::first_triangles(oracle::soup(std::max(count, 1u), 0.3, kSeed), count));
    for (const double budget : {1.0, 2.0}) CHECK(check_tree(scene, budget, kTiny, "few") < 1.05);
  }
}

TEST_CASE("top-down trees cost no more than the host's") {
  INFO("seed " << kSeed);
  const Scene star(oracle::star(4, kSeed)), soup(oracle::soup(3000, 0.2, kSeed)), torus(oracle::torus(50, 30, 0.3));
  for (const gpu::TopDownTuning& tuning : {kTiny, gpu::TopDownTuning{}}) {
    CHECK(check_tree(star, 1.0, tuning, "star") < 1.01);
    CHECK(check_tree(soup, 1.0, tuning, "soup") < 1.01);
    CHECK(check_tree(torus, 1.0, tuning, "torus") < 1.01);
  }
}

TEST_CASE("spatial splits cost no more than the host's") {
  INFO("seed " << kSeed);
  const Scene star(oracle::star(3, kSeed)), soup(oracle::soup(600, 0.3, kSeed)),
      needles(oracle::needles(400, 100, kSeed));
  for (const build::SplitRules& rules : {kRules, kWholeRules}) {
    CHECK(check_tree(star, 1.5, kTiny, "star", rules) < 1.01);
    CHECK(check_tree(star, 1.5, {}, "star", rules) < 1.01);
    CHECK(check_tree(soup, 1.5, kTiny, "soup", rules) < 1.01);
    CHECK(check_tree(needles, 3.0, kTiny, "needles", rules) < 1.01);
  }
}

TEST_CASE("odd meshes, built top-down") {
  INFO("seed " << kSeed);
  oracle::Mesh line;
  for (unsigned i = 0; i < 300; ++i) {
    const float x = std::ldexp(1.0f, static_cast<int>(i % 200) - 100);
    oracle::append(line, {x, 0, 0}, {x * 1.5f, 0, 0}, {x, x * 1e-3f, 0});
  }
  const std::pair<const char*, oracle::Mesh> meshes[] = {
      {"torture", oracle::torture(500, kSeed)},
      {"identical", oracle::identical(300)},
      {"concentric", oracle::concentric(200, kSeed)},
      {"line", line},
      {"plane", oracle::grid_plane(15, 1, 0.5f)},
      {"huge", oracle::placed(oracle::soup(300, 0.2, kSeed), 1e38)},
      {"denormal", oracle::placed(oracle::soup(300, 0.2, kSeed), 1e-39)},
      {"far", oracle::placed(oracle::soup(300, 1e-7, kSeed), 1, {1e6, 0, 0})},
  };
  for (const auto& [name, mesh] : meshes) {
    const Scene scene(mesh);
    for (const double budget : {1.0, 2.0}) check_tree(scene, budget, kTiny, name);
    check_tree(scene, 2.0, kTiny, name, kWholeRules);
  }
}

TEST_CASE("where planes cut more references than there is room for") {
  INFO("seed " << kSeed);
  const std::pair<const char*, oracle::Mesh> meshes[] = {
      {"concentric", oracle::concentric(220, kSeed)},
      {"cables", oracle::cables(220, kSeed)},
      {"fan", oracle::fan(220)},
      {"large", oracle::soup(260, 0.9, kSeed)},
  };
  for (const auto& [name, mesh] : meshes) {
    const Scene scene(mesh);
    for (const build::SplitRules& rules : {kRules, kWholeRules})
      for (const double budget : {1.1, 3.0}) {
        CHECK(check_tree(scene, budget, kTiny, name, rules) < 1.05);
        // Ranges have several tasks, or one.
        const auto tree_of = [&, budget = budget](std::uint32_t task) {
          return build_on_device(scene, budget, true, {.task = task, .wave_range = 40, .spare_levels = 6},
                                 std::byte{0xa5}, {}, rules);
        };
        CHECK(tree_of(41).same_bytes(tree_of(2048)));
      }
  }
}

TEST_CASE("a deep top-down tree is split by count before it is too deep") {
  // Each four are much farther away than those before: a split takes off few.
  oracle::Mesh mesh;
  for (int i = -45; i <= 45; ++i)
    for (unsigned copy = 0; copy < 4; ++copy) {
      const auto x = static_cast<float>(std::pow(2.6, i)), y = x / 64 * static_cast<float>(copy + 1);
      oracle::append(mesh, {x, 0, 0}, {x * 1.25f, y, 0}, {x, y, x / 8});
    }
  const Scene scene(mesh, false);
  for (const unsigned spare : {0u, 3u, 40u})
    for (const double budget : {1.0, 1.7})
      check_tree(scene, budget, {.task = 33, .wave_range = 32, .spare_levels = spare}, "deep");
  // So much capacity that the limit of depth seems near early.
  check_tree(scene, 1000.0, {.task = 33, .wave_range = 32, .spare_levels = 40}, "capacity");
}

// Emulated it takes minutes: for GPUs.
TEST_CASE("many references, built top-down") {
  INFO("seed " << kSeed);
  oracle::Mesh mesh = oracle::soup(150000, 0.01, kSeed);
  oracle::append(mesh, oracle::needles(200, 300, kSeed));
  const Scene scene(std::move(mesh));
  for (const double budget : {1.0, 1.5}) CHECK(check_tree(scene, budget, {}, "many") < 1.01);
  CHECK(check_tree(scene, 1.5, {}, "many", kWholeRules) < 1.01);
}

TEST_CASE("top-down trees ask between their levels and slices whether to go on") {
  const Scene scene(oracle::soup(400, 0.2, kSeed));
  std::vector<double> asked;
  const build::ProgressCallback note = [&](const build::Progress& progress) {
    asked.push_back(progress.fraction);
    return true;
  };
  const auto expected = build_on_device(scene, 1.5, true, kTiny);
  const auto tree =
      build_on_device(scene, 1.5, true, kTiny, std::byte{0xa5}, gpu::LongStep(note, "split", 0.2, 0.5, 1));
  // Lists of ranges are processed in slices then.
  CHECK(tree.same_bytes(expected));
  CHECK(asked.size() > 100);
  CHECK(std::is_sorted(asked.begin(), asked.end()));
  CHECK((asked.front() > 0.2 && asked.back() < 0.5));
}
