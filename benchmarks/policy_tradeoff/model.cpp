#include "model.h"

namespace hiprt::bench {

Model make_model(std::string name, tools::Mesh mesh) {
  Model model;
  model.name = std::move(name);
  model.mesh = std::move(mesh);
  return model;
}

Model make_model(std::string name, const oracle::Mesh& mesh, double room, double scale, const oracle::Double3& offset) {
  const oracle::Mesh moved = oracle::placed(mesh, scale, offset);
  tools::Mesh owned;
  owned.positions = moved.positions;
  owned.triangles = moved.triangles;
  Model model = make_model(std::move(name), std::move(owned));
  model.centre = Vec3(static_cast<float>(offset[0]), static_cast<float>(offset[1]), static_cast<float>(offset[2]));
  model.room = static_cast<float>(room * scale);
  double extent = 0.0;
  for (const build::Position& p : mesh.positions)
    for (const float x : p) extent = std::max(extent, std::abs(double{x}) * scale);
  model.extent = static_cast<float>(extent);
  return model;
}

build::Result<Trees> build_trees(const Model& model) {
  const build::TriangleMesh mesh{.positions = model.mesh.positions, .triangles = model.mesh.triangles};
  Trees trees;
  for (std::size_t layout = 0; layout < kLayouts; ++layout) {
    auto bvh = build::build({&mesh, 1}, {.nodes = static_cast<NodeLayout>(layout + 1)});
    if (!bvh) return tl::unexpected(bvh.error());
    trees[layout] = std::move(*bvh);
  }
  return trees;
}

}  // namespace hiprt::bench
