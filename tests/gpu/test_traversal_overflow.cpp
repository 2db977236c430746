// Stacks that are too small say so, count the rays, and write nowhere else.

#include <hiprt_build/file.h>
#include <tests/gpu/traversal_reference.h>
#include <tests/gpu/traversal_runner.h>

#include <cstdio>
#include <cstdlib>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kRaySeed = 32;
constexpr unsigned kRays = 32 * kBlock;

/// What failed and what did not are told apart, counted by the host as by the stacks, and the rest is true.
void check_failures(const char* name, const Variant& variant, const Run& run, const Reference& reference) {
  std::uint32_t failed = 0, wrong = 0, untold = 0;
  for (std::size_t i = 0; i < reference.rays.size(); ++i) {
    const Answer& answer = run.answers[i];
    const bool overflow = answer.state == TraversalState::kStackOverflow;
    failed += overflow;
    untold += overflow != (answer.failed != 0);
    // Hits before the failure are true ones.
    if (!overflow && !is_right(answer, reference.plain[i], variant.query, variant.filter, variant.depth)) ++wrong;
    if (overflow && answer.hit.found() && digest_of(answer.hit) != digest_of(reference.plain[i].closest)) ++wrong;
  }
  std::printf("overflow, %s %s: %u of %zu rays failed, %u counted, %u wrong\n", name, variant.name, failed,
              reference.rays.size(), run.failed_rays, wrong);
  CHECK(failed > 0);
  CHECK(failed < reference.rays.size());
  CHECK(run.failed_rays == failed);
  CHECK(untold == 0);
  CHECK(wrong == 0);
  CHECK(run.broken_guards == 0);
}

}  // namespace

TEST_CASE("stacks that are too small") {
  const SceneSource source = scene_sources(HIPRT_GPU_SCENE_SEED)[0];
  const char* folder = std::getenv("HIPRT_GPU_SCENES");
  const std::filesystem::path path = folder != nullptr ? folder : HIPRT_GPU_SCENES;
  const build::Buffer file = must(build::map_file(path / file_name(source.name, NodeLayout::kPlanes)));
  gpu::DeviceAllocator allocator;
  const gpu::DeviceScene scene = must(gpu::upload_scene(file.bytes(), nullptr, allocator));
  const Reference reference = make_reference(source, make_scene_view(*open_buffer(file.bytes())), kRays, kRaySeed);
  for (const Variant& variant : tiny_stack_variants()) {
    INFO(variant.name);
    // Entries of global memory: with the ring of 4, as many as the other stacks have.
    const std::uint32_t entries = std::string(variant.name).starts_with("global") ? 5 : 1;
    check_failures("tiny", variant, Runner().run(variant, scene.view, reference.rays, entries), reference);
  }
}

namespace {

/// A chain of nodes, each with one leaf of one triangle and the next node; the last has the leaf alone.
struct Chain {
  std::vector<PlanesBoxNode> nodes;
  std::vector<PlanesLeaf> leaves;
  GeometryRecord geometry{};
  Box bounds{{0.0f, 0.0f, 0.0f}, {1.0f, 1.0f, 0.0f}};

  explicit Chain(unsigned levels) : nodes(levels), leaves(levels) {
    geometry.mask = 0xffffffffu;
    for (unsigned i = 0; i < levels; ++i) {
      bounds.max[2] = static_cast<float>(levels - 1);
      set_node(i, levels);
      set_leaf(i);
    }
  }
  NodeRef node_ref(unsigned i) const { return make_ref(i * sizeof(PlanesBoxNode), NodeType::kBox32); }

 private:
  void set_node(unsigned i, unsigned levels) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const Box empty{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
    const float height = static_cast<float>(i);
    for (unsigned child = 0; child < kBranching; ++child) {
      nodes[i].child[child] = kInvalidRef;
      PlanesLayout::set_box(nodes[i], child, empty);
    }
    nodes[i].child[0] = make_ref(nodes.size() * sizeof(PlanesBoxNode) + i * sizeof(PlanesLeaf), NodeType::kTriangle0);
    PlanesLayout::set_box(nodes[i], 0, Box{{0.0f, 0.0f, height}, {1.0f, 1.0f, height}});
    if (i + 1 == levels) return;
    nodes[i].child[1] = node_ref(i + 1);
    PlanesLayout::set_box(nodes[i], 1, Box{{0.0f, 0.0f, height + 1}, {1.0f, 1.0f, bounds.max[2]}});
  }
  void set_leaf(unsigned i) {
    constexpr float kCorners[4][2] = {{0.0f, 0.0f}, {1.0f, 0.0f}, {0.0f, 1.0f}, {0.0f, 1.0f}};
    for (unsigned vertex = 0; vertex < 4; ++vertex) {
      leaves[i].coordinate[0][vertex] = kCorners[vertex][0];
      leaves[i].coordinate[1][vertex] = kCorners[vertex][1];
      leaves[i].coordinate[2][vertex] = static_cast<float>(i);
    }
    leaves[i].info = {{i, kInvalidId}, kLastInRun, TriangleId::from_rotation(0)};
  }
};

}  // namespace

TEST_CASE("a tree too deep for a restart trail") {
  constexpr unsigned kLevels = 80;
  const Chain chain(kLevels);
  std::vector<std::byte> bytes(chain.nodes.size() * sizeof(PlanesBoxNode) + chain.leaves.size() * sizeof(PlanesLeaf));
  std::memcpy(bytes.data(), chain.nodes.data(), chain.nodes.size() * sizeof(PlanesBoxNode));
  std::memcpy(bytes.data() + chain.nodes.size() * sizeof(PlanesBoxNode), chain.leaves.data(),
              chain.leaves.size() * sizeof(PlanesLeaf));
  gpu::DeviceAllocator allocator;
  auto device = must(gpu::DeviceArray<std::byte>::from(bytes, nullptr, allocator));
  const auto geometry = must(gpu::DeviceArray<GeometryRecord>::from(std::span(&chain.geometry, 1), nullptr, allocator));
  SceneView scene{.base = device.data(), .size = bytes.size(), .geometries = geometry.data()};
  scene.root = chain.node_ref(0);
  scene.bounds = chain.bounds;
  scene.features = feature_bit(Feature::kTriangles);
  // Ray i goes through triangle i alone; the triangles from 64 on are deeper than the trail.
  std::vector<Ray> rays(kLevels);
  for (unsigned i = 0; i < kLevels; ++i)
    rays[i] = {.origin = {0.25f, 0.25f, static_cast<float>(i) - 0.5f}, .tmax = 0.75f};
  for (const Variant& variant : restart_variants()) {
    const Run run = Runner().run(variant, scene, rays, 1);
    std::uint32_t failed = 0;
    for (unsigned i = 0; i < kLevels; ++i) {
      INFO(variant.name << ", ray " << i);
      const bool deep = i >= 64;
      REQUIRE((run.answers[i].state == TraversalState::kStackOverflow) == deep);
      REQUIRE(run.answers[i].hit.primitive == (deep ? kInvalidId : i));
      REQUIRE((run.answers[i].failed != 0) == deep);
      failed += deep;
    }
    std::printf("overflow, chain of %u nodes, %s: %u rays failed, %u counted\n", kLevels, variant.name, failed,
                run.failed_rays);
    CHECK(run.failed_rays == failed);
    CHECK(run.broken_guards == 0);
  }
}
