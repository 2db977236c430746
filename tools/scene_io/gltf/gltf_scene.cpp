#include <tools/scene_io/gltf/gltf_scene.h>

#include <tools/base/errors.h>

#include <tiny_gltf.h>

#include <algorithm>
#include <utility>

namespace hiprt::tools {
namespace {

/// Sizes are as check_gltf() demands.
build::Result<Transform> local_transform(const tinygltf::Node& node, int index) {
  if (!node.matrix.empty()) {
    Transform result;
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t column = 0; column < 4; ++column) result.m[row][column] = node.matrix[column * 4 + row];
    return result;
  }
  Placement placement;
  const auto take = [](const std::vector<double>& from, auto& to) {
    if (from.size() == to.size()) std::copy(from.begin(), from.end(), to.begin());
  };
  take(node.translation, placement.translation);
  take(node.scale, placement.scale);
  take(node.rotation, placement.rotation);
  auto placed = transform_of(placement);
  if (!placed) placed.error().message.insert(0, "node " + std::to_string(index) + ": its ");
  return placed;
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

build::Result<std::vector<Transform>> world_transforms(const tinygltf::Model& model) {
  const std::size_t count = model.nodes.size();
  std::vector<bool> is_child(count), seen(count);
  const auto exists = [&](int node) { return node >= 0 && static_cast<std::size_t>(node) < count; };
  for (const auto& node : model.nodes)
    for (const int child : node.children)
      if (exists(child)) is_child[static_cast<std::size_t>(child)] = true;
  std::vector<Transform> result(count);
  std::vector<std::pair<std::size_t, Transform>> stack;  // Nodes, and from their parents to the world.
  for (std::size_t i = 0; i < count; ++i)
    if (!is_child[i]) stack.emplace_back(i, Transform{});
  while (!stack.empty()) {
    const auto [index, parent] = stack.back();
    stack.pop_back();
    if (seen[index]) continue;
    seen[index] = true;
    const auto local = local_transform(model.nodes[index], static_cast<int>(index));
    if (!local) return tl::unexpected(local.error());
    result[index] = parent * *local;
    for (const int child : model.nodes[index].children)
      if (exists(child)) stack.emplace_back(static_cast<std::size_t>(child), result[index]);
  }
  return result;
}

build::Result<std::vector<NodeMesh>> flatten(const tinygltf::Model& model) {
  const auto roots = roots_of(model);
  if (!roots) return tl::unexpected(roots.error());
  std::vector<std::pair<int, Transform>> stack;
  for (auto root = roots->rbegin(); root != roots->rend(); ++root) stack.emplace_back(*root, Transform{});
  std::vector<bool> seen(model.nodes.size());
  std::vector<NodeMesh> uses;
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
      uses.push_back({index, node.mesh, node.skin >= 0 ? Transform{} : to_world});
    }
    for (auto child = node.children.rbegin(); child != node.children.rend(); ++child)
      stack.emplace_back(*child, to_world);
  }
  return uses;
}

}  // namespace hiprt::tools
