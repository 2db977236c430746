#include "gltf_scene.h"

#include "mesh_formats.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace hiprt::tools {
namespace {

/// A rotation of length 1. Files round theirs; what is farther off is no rotation.
build::Result<std::array<double, 4>> unit_quaternion(std::array<double, 4> q, int index) {
  constexpr double kTolerance = 1e-3;
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::abs(length - 1) <= kTolerance))
    return invalid_input("node " + std::to_string(index) + ": its rotation has the length " + std::to_string(length) +
                         ", which may differ from 1 by 0.001 at most");
  for (double& part : q) part /= length;
  return q;
}

/// Sizes are as check_gltf() demands.
build::Result<Transform> local_transform(const tinygltf::Node& node, int index) {
  Transform result;
  if (!node.matrix.empty()) {
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t column = 0; column < 4; ++column) result.m[row][column] = node.matrix[column * 4 + row];
    return result;
  }
  std::array<double, 3> t{0, 0, 0}, s{1, 1, 1};
  std::array<double, 4> q{0, 0, 0, 1};
  const auto take = [](const std::vector<double>& from, auto& to) {
    if (from.size() == to.size()) std::copy(from.begin(), from.end(), to.begin());
  };
  take(node.translation, t);
  take(node.scale, s);
  take(node.rotation, q);
  const auto unit = unit_quaternion(q, index);
  if (!unit) return tl::unexpected(unit.error());
  const auto [x, y, z, w] = *unit;
  const std::array<std::array<double, 3>, 3> r{{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                                                {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                                                {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) result.m[row][column] = r[row][column] * s[column];
    result.m[row][3] = t[row];
  }
  return result;
}

build::Result<std::vector<int>> roots_of(const tinygltf::Model& model) {
  if (!model.scenes.empty()) {
    const int scene = model.defaultScene < 0 ? 0 : model.defaultScene;
    if (static_cast<std::size_t>(scene) >= model.scenes.size())
      return invalid_input("the default scene is " + std::to_string(scene) + ", but there are only " +
                           std::to_string(model.scenes.size()));
    return model.scenes[static_cast<std::size_t>(scene)].nodes;
  }
  std::vector<bool> is_child(model.nodes.size());
  for (const auto& node : model.nodes)
    for (const int child : node.children)
      if (child >= 0 && static_cast<std::size_t>(child) < is_child.size())
        is_child[static_cast<std::size_t>(child)] = true;
  std::vector<int> roots;
  for (std::size_t i = 0; i < is_child.size(); ++i)
    if (!is_child[i]) roots.push_back(static_cast<int>(i));
  if (roots.empty() && !model.nodes.empty()) return invalid_input("every node is the child of another: a cycle");
  return roots;
}

}  // namespace

build::Position Transform::operator()(const build::Position& p) const {
  build::Position result;
  for (std::size_t row = 0; row < 3; ++row)
    result[row] = static_cast<float>(m[row][0] * p[0] + m[row][1] * p[1] + m[row][2] * p[2] + m[row][3]);
  return result;
}

Transform Transform::operator*(const Transform& inner) const {
  Transform result;
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 4; ++column) {
      double sum = column == 3 ? m[row][3] : 0;
      for (std::size_t k = 0; k < 3; ++k) sum += m[row][k] * inner.m[k][column];
      result.m[row][column] = sum;
    }
  return result;
}

bool Transform::mirrors() const {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
             m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]) <
         0;
}

build::Result<std::vector<MeshUse>> flatten(const tinygltf::Model& model) {
  const auto roots = roots_of(model);
  if (!roots) return tl::unexpected(roots.error());
  std::vector<std::pair<int, Transform>> stack;
  for (auto root = roots->rbegin(); root != roots->rend(); ++root) stack.emplace_back(*root, Transform{});
  std::vector<bool> seen(model.nodes.size());
  std::vector<MeshUse> uses;
  while (!stack.empty()) {
    const auto [index, parent] = stack.back();
    stack.pop_back();
    if (index < 0 || static_cast<std::size_t>(index) >= seen.size())
      return invalid_input("node " + std::to_string(index) + " does not exist; there are " +
                           std::to_string(seen.size()));
    const auto at = static_cast<std::size_t>(index);
    if (seen[at]) return invalid_input("node " + std::to_string(index) + " is reached twice: a cycle, or two parents");
    seen[at] = true;
    const tinygltf::Node& node = model.nodes[at];
    const auto local = local_transform(node, index);
    if (!local) return tl::unexpected(local.error());
    const Transform to_world = parent * *local;
    if (node.mesh >= 0) {
      if (static_cast<std::size_t>(node.mesh) >= model.meshes.size())
        return invalid_input("node " + std::to_string(index) + ": mesh " + std::to_string(node.mesh) +
                             " does not exist");
      // glTF 2.0, 3.7.3.3: joints place a skinned mesh, its node does not.
      uses.push_back({node.mesh, node.skin >= 0 ? Transform{} : to_world});
    }
    for (auto child = node.children.rbegin(); child != node.children.rend(); ++child)
      stack.emplace_back(*child, to_world);
  }
  return uses;
}

}  // namespace hiprt::tools
