// Trees of other builders in device memory: the same hits as any other tree, and refusal of what is no tree.

#include <hiprt_build/gpu/import.h>
#include <tests/gpu/builders/build_input.h>
#include <tests/oracle/odd_meshes.h>

#include <algorithm>
#include <functional>
#include <numeric>

using namespace hiprt;
using namespace hiprt::checks;
using gpu::ImportedLeaf;
using gpu::ImportedNode;

namespace {

struct Tree {
  std::vector<ImportedNode> nodes;
  std::vector<ImportedLeaf> leaves;
};

/// A random tree over leaves with these primitives. Numbers of nodes are shuffled, except the root's.
Tree random_tree(const std::vector<ImportedLeaf>& leaves, std::uint64_t seed) {
  oracle::Random random(seed);
  Tree tree;
  tree.leaves = leaves;
  const auto count = static_cast<std::uint32_t>(leaves.size());
  if (count == 1) return tree;
  std::vector<std::uint32_t> numbers(count - 1);
  std::iota(numbers.begin(), numbers.end(), 0u);
  for (std::uint32_t i = count - 2; i > 1; --i) std::swap(numbers[i], numbers[1 + random.below(i)]);
  std::uint32_t used = 0;
  tree.nodes.resize(count - 1);
  const std::function<std::uint32_t(std::uint32_t, std::uint32_t)> split = [&](std::uint32_t begin, std::uint32_t end) {
    const std::uint32_t number = numbers[used++], middle = begin + 1 + random.below(end - begin - 1);
    for (unsigned c = 0; c < 2; ++c) {
      const std::uint32_t first = c == 0 ? begin : middle, last = c == 0 ? middle : end;
      const bool leaf = last - first == 1;
      const std::uint32_t child = leaf ? first : split(first, last);
      tree.nodes[number].child[c] = child;
      tree.nodes[number].is_leaf[c] = leaf ? 1 : 0;
    }
    return number;
  };
  split(0, count);
  return tree;
}

std::vector<ImportedLeaf> one_leaf_each(std::uint32_t count) {
  std::vector<ImportedLeaf> leaves(count);
  for (std::uint32_t i = 0; i < count; ++i) leaves[i].primitive = count - 1 - i;
  return leaves;
}

/// Memory of a tree and its import.
struct Importer {
  gpu::Result<gpu::BuiltScene> run(const gpu::DeviceGeometry& geometry, const Tree& tree,
                                   const gpu::BuildOptions& options = {}) {
    const auto nodes = must(gpu::DeviceArray<ImportedNode>::from(tree.nodes, nullptr, allocator));
    const auto leaves = must(gpu::DeviceArray<ImportedLeaf>::from(tree.leaves, nullptr, allocator));
    const gpu::DeviceTree there{nodes.data(), leaves.data(), static_cast<std::uint32_t>(tree.leaves.size())};
    const gpu::BuildSizes sizes = must(gpu::import_sizes(geometry, there, options));
    auto output = must(gpu::DeviceBuffer::make(sizes.output, nullptr, allocator));
    auto scratch = must(gpu::DeviceBuffer::make(sizes.scratch, nullptr, allocator));
    must(output.fill(std::byte{0xa5}, nullptr));
    must(scratch.fill(std::byte{0x5a}, nullptr));
    const auto report = must(gpu::enqueue_import(geometry, there, options, output.data(), scratch.data(), nullptr));
    auto scene = gpu::compact(report, nullptr, allocator);
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
    return scene;
  }

  CountingAllocator allocator;
};

/// The hits of an imported scene are those of the host's tree over the same mesh.
void check_hits(const gpu::BuiltScene& scene, const build::Buffer& host, std::uint64_t seed) {
  const build::Buffer file = must(gpu::download_file(scene, "test_import", nullptr));
  const SceneView one = make_scene_view(checked_view(file)), other = make_scene_view(*open_buffer(host.bytes()));
  oracle::Random random(seed);
  unsigned hits = 0;
  for (unsigned i = 0; i < 300; ++i) {
    Ray ray;
    const auto origin = random.in_cube(3), target = random.in_cube(1);
    ray.origin = {origin[0], origin[1], origin[2]};
    ray.direction = {target[0] - origin[0], target[1] - origin[1], target[2] - origin[2]};
    const Hit a = closest_hit(one, ray), b = closest_hit(other, ray);
    INFO("ray " << i << ", seed " << seed);
    REQUIRE(a.found() == b.found());
    REQUIRE(a.primitive == b.primitive);
    REQUIRE((!a.found() || (a.t == b.t && a.u == b.u)));
    hits += a.found() ? 1 : 0;
  }
  CHECK(hits > 20);
}

}  // namespace

TEST_CASE("imported trees have the hits of any other tree") {
  INFO("seed " << kSeed);
  oracle::Mesh mesh = oracle::soup(300, 0.4, kSeed);
  // Dropped triangles, whose leaves have no place.
  mesh.triangles[7] = {3, 3, 4};
  mesh.triangles[8] = {5, 5, 5};
  mesh.positions[mesh.triangles[100][1]][2] = std::numeric_limits<float>::quiet_NaN();
  Input input({mesh});
  const build::Bvh host = input.build_on_host({});
  Importer importer;
  const Tree tree = random_tree(one_leaf_each(300), kSeed);
  const gpu::BuiltScene scene = must(importer.run(input.geometries[0], tree));
  CHECK(scene.report.leaves == 297);
  CHECK(scene.report.missing == 0);
  CHECK(scene.report.builder == build::Builder::kImported);
  check_hits(scene, host.buffer, kSeed);
  check_hits(must(importer.run(input.geometries[0], tree, {.nodes = NodeLayout::kQuantized, .reinsertion_rounds = 2})),
             host.buffer, kSeed + 1);
}

TEST_CASE("imported trees with primitives in several leaves, and without some") {
  INFO("seed " << kSeed);
  const oracle::Mesh mesh = oracle::soup(100, 0.6, kSeed);
  Input input({mesh});
  std::vector<ImportedLeaf> leaves;
  for (std::uint32_t i = 0; i < 100; ++i) {
    Box box{{9, 9, 9}, {-9, -9, -9}};
    for (const std::uint32_t index : mesh.triangles[i])
      for (unsigned axis = 0; axis < 3; ++axis) {
        box.min[axis] = std::min(box.min[axis], mesh.positions[index][axis]);
        box.max[axis] = std::max(box.max[axis], mesh.positions[index][axis]);
      }
    // Two halves along x.
    const float middle = 0.5f * (box.min[0] + box.max[0]);
    leaves.push_back({{box.min[0], box.min[1], box.min[2]}, {middle, box.max[1], box.max[2]}, i});
    leaves.push_back({{middle, box.min[1], box.min[2]}, {box.max[0], box.max[1], box.max[2]}, i});
  }
  Importer importer;
  const gpu::BuiltScene scene = must(importer.run(input.geometries[0], random_tree(leaves, kSeed)));
  CHECK(scene.report.leaves == 200);
  CHECK((scene.view.features & feature_bit(Feature::kSplitReferences)) != 0);
  check_hits(scene, input.build_on_host({}).buffer, kSeed);
  // Without triangles 90 to 99.
  leaves.resize(180);
  const gpu::BuiltScene part = must(importer.run(input.geometries[0], random_tree(leaves, kSeed)));
  CHECK(part.report.missing == 10);
  checked_view(must(gpu::download_file(part, "test_import", nullptr)));
}

TEST_CASE("imported trees over pairs, over boxes, and of one leaf") {
  INFO("seed " << kSeed);
  const oracle::Mesh mesh = oracle::icosphere(1);
  Input input({mesh}, {std::vector<Box>(5, Box{{0, 0, 0}, {1, 1, 1}})});
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  std::vector<build::TrianglePair> pairs;
  for (std::uint32_t i = 0; i < count; i += 2) pairs.push_back({i + 1, i});
  Importer importer;
  const auto device_pairs = must(gpu::DeviceArray<build::TrianglePair>::from(pairs, nullptr, importer.allocator));
  gpu::DeviceGeometry paired = input.geometries[0];
  paired.pairs = device_pairs.data();
  paired.pair_count = static_cast<std::uint32_t>(pairs.size());
  const gpu::BuiltScene scene = must(importer.run(paired, random_tree(one_leaf_each(paired.pair_count), kSeed)));
  CHECK(scene.report.pairs > 0);
  CHECK(scene.report.leaves == count - scene.report.pairs);
  CHECK(scene.report.missing == 0);
  const build::TriangleMesh view{.positions = mesh.positions, .triangles = mesh.triangles};
  check_hits(scene, must(build::build(build::SceneInput{.meshes = {&view, 1}})).buffer, kSeed);
  const gpu::BuiltScene boxes = must(importer.run(input.geometries[1], random_tree(one_leaf_each(5), kSeed)));
  CHECK(boxes.report.custom_leaves == 5);
  checked_view(must(gpu::download_file(boxes, "test_import", nullptr)));
  gpu::DeviceGeometry one = input.geometries[0];
  one.primitive_count = 1;
  CHECK(must(importer.run(one, {{}, {ImportedLeaf{{}, {}, 0}}})).report.leaves == 1);
}

TEST_CASE("imports of nodes that are no tree are refused") {
  Input input({oracle::soup(20, 0.4, kSeed)});
  const Tree good = random_tree(one_leaf_each(20), kSeed);
  Importer importer;
  const auto refused = [&](const auto& spoil) {
    Tree tree = good;
    spoil(tree);
    const auto scene = importer.run(input.geometries[0], tree);
    REQUIRE_FALSE(scene.has_value());
    CHECK(scene.error().code == build::ErrorCode::kInvalidInput);
    return scene.error().message;
  };
  const std::string start = "the imported nodes do not form a tree: see node ";
  CHECK(refused([](Tree& t) { t.leaves[3].primitive = 20; }).find(start + "22 (") == 0);
  CHECK(refused([](Tree& t) { t.nodes[6].child[1] = 20; }).find(start + "6 (") == 0);
  CHECK(refused([](Tree& t) { t.nodes[6].is_leaf[0] = 2; }).find(start + "6 (") == 0);
  CHECK(refused([](Tree& t) { t.nodes[5] = t.nodes[9]; }).find(start) == 0);
  CHECK(refused([](Tree& t) {
          t.nodes[4].child[0] = 0;
          t.nodes[4].is_leaf[0] = 0;
        }).find(start + "4 (") == 0);
  // A ring: its own child instead of a node, whose subtree then hangs nowhere.
  CHECK(refused([](Tree& t) {
          for (std::uint32_t i = 1; i < t.nodes.size(); ++i)
            for (unsigned c = 0; c < 2; ++c)
              if (t.nodes[0].is_leaf[c] == 0 && t.nodes[0].child[c] != 0) {
                const std::uint32_t cut = t.nodes[0].child[c];
                for (unsigned k = 0; k < 2; ++k)
                  if (t.nodes[cut].is_leaf[k] == 1) {
                    std::swap(t.nodes[0].child[c], t.nodes[cut].child[k]);
                    std::swap(t.nodes[0].is_leaf[c], t.nodes[cut].is_leaf[k]);
                    return;
                  }
              }
          t.nodes[0].is_leaf[0] = 7;
        }).find(start) == 0);
  CHECK(error_of(gpu::import_sizes(input.geometries[0], {})).message.find("import: a tree of 0 leaves") == 0);
}
