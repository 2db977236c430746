// A tree of one's own over a row of triangles, imported.

#include <hiprt_build/exchange.h>

#include <cstdio>

using namespace hiprt::build;

int main() {
  constexpr std::uint32_t kLeaf = 25;  // Triangles in each of four leaves.
  std::vector<Position> positions;
  std::vector<Triangle> triangles;
  ExchangeBvh tree;
  for (std::uint32_t i = 0; i < 4 * kLeaf; ++i) {
    const float x = static_cast<float>(i);  // Triangle i is in x from i to i + 1.
    positions.insert(positions.end(), {{x, 0, 0}, {x + 1, 0, 0}, {x, 1, 0}});
    triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    tree.primitives.push_back(i);  // In any order: leaves are runs of this list.
  }
  const auto over = [](std::uint32_t first, std::uint32_t count) {
    return hiprt::Box{{static_cast<float>(first), 0, 0}, {static_cast<float>(first + count), 1, 0}};
  };
  tree.nodes.push_back({.box = over(0, 4 * kLeaf), .first = 1, .children = 4});  // Nodes 1 to 4.
  for (std::uint32_t first = 0; first < 4 * kLeaf; first += kLeaf)
    tree.nodes.push_back({.box = over(first, kLeaf), .first = first, .primitives = kLeaf});
  const TriangleMesh meshes[] = {{positions, triangles}};
  const auto bvh = import_tree({.meshes = meshes}, tree);
  std::puts(bvh ? "imported" : bvh.error().message.c_str());  // Errors name the node and the fault.
  return bvh ? 0 : 1;
}
