#include <tools/scene_io/gltf/gltf_deform.h>

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/scene_io/gltf/gltf_accessor.h>

#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

namespace hiprt::tools {
namespace {

/// Three numbers for each vertex, in double until the last step.
using Vectors = std::vector<std::array<double, 3>>;

template <class Real> Vectors to_double(const std::vector<std::array<Real, 3>>& from) {
  Vectors result;
  result.reserve(from.size());
  for (const auto& v : from) result.push_back({double{v[0]}, double{v[1]}, double{v[2]}});
  return result;
}

std::array<float, 3> rounded(const std::array<double, 3>& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

/// Adds the displacements that targets have for one attribute.
build::Result<void> add_targets(const tinygltf::Model& model, const tinygltf::Primitive& primitive, const char* name,
                                const std::vector<double>& weights, Vectors& values) {
  for (std::size_t i = 0; i < std::min(weights.size(), primitive.targets.size()); ++i) {
    if (interrupted()) return cancelled();
    const auto attribute = primitive.targets[i].find(name);
    if (weights[i] == 0 || attribute == primitive.targets[i].end()) continue;
    const std::string location = "target " + std::to_string(i) + ", " + name + ": ";
    const auto moves = read_vectors(model, attribute->second, 3);
    if (!moves) return invalid_input(location + moves.error().message);
    if (moves->size() != 3 * values.size())
      return invalid_input(location + std::to_string(moves->size() / 3) + " elements, but the primitive has " +
                           std::to_string(values.size()) + " vertices");
    for (std::size_t k = 0; k < moves->size(); ++k) values[k / 3][k % 3] += weights[i] * (*moves)[k];
  }
  return {};
}

/// The joints of every vertex with their weights, of all sets.
struct Influences {
  std::size_t each = 0;  ///< Per vertex: 4 for each set.
  std::vector<std::uint32_t> joints;
  std::vector<double> weights;
};

/// One set of four: attributes JOINTS_n and WEIGHTS_n.
build::Result<std::vector<double>> read_set(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                            const std::string& name, std::size_t vertices) {
  const auto attribute = primitive.attributes.find(name);
  if (attribute == primitive.attributes.end()) return invalid_input(name + " is missing");
  auto values = read_vectors(model, attribute->second, 4);
  if (!values) return invalid_input(name + ": " + values.error().message);
  if (values->size() != 4 * vertices)
    return invalid_input(name + " has " + std::to_string(values->size() / 4) + " elements, but POSITION has " +
                         std::to_string(vertices));
  return values;
}

build::Result<Influences> read_influences(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                          std::size_t vertices, std::size_t joint_count) {
  Influences result;
  std::vector<std::pair<std::vector<double>, std::vector<double>>> sets;
  for (std::size_t n = 0; primitive.attributes.contains("JOINTS_" + std::to_string(n)); ++n) {
    auto joints = read_set(model, primitive, "JOINTS_" + std::to_string(n), vertices);
    if (!joints) return tl::unexpected(joints.error());
    auto weights = read_set(model, primitive, "WEIGHTS_" + std::to_string(n), vertices);
    if (!weights) return tl::unexpected(weights.error());
    sets.emplace_back(std::move(*joints), std::move(*weights));
  }
  result.each = 4 * sets.size();
  for (std::size_t vertex = 0; vertex < vertices; ++vertex)
    for (const auto& [joints, weights] : sets)
      for (std::size_t k = 4 * vertex; k < 4 * vertex + 4; ++k) {
        if (weights[k] != 0 && !(joints[k] >= 0 && joints[k] < static_cast<double>(joint_count)))
          return invalid_input("vertex " + std::to_string(vertex) + ": joint " +
                               std::to_string(static_cast<std::int64_t>(joints[k])) + ", but the skin has only " +
                               std::to_string(joint_count));
        result.joints.push_back(weights[k] != 0 ? static_cast<std::uint32_t>(joints[k]) : 0);
        result.weights.push_back(weights[k]);
      }
  return result;
}

/// The mean of the joints' transforms for one vertex; nothing if it has no weights.
std::optional<Transform> blended(const Influences& influences, std::size_t vertex,
                                 const std::vector<Transform>& joints) {
  Transform sum{{{{0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}}}};
  double all = 0;
  for (std::size_t k = influences.each * vertex; k < influences.each * (vertex + 1); ++k) {
    const double weight = influences.weights[k];
    if (weight == 0) continue;
    all += weight;
    const Transform& joint = joints[influences.joints[k]];
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t column = 0; column < 4; ++column) sum.m[row][column] += weight * joint.m[row][column];
  }
  if (!(std::abs(all) > 0)) return std::nullopt;
  for (auto& row : sum.m)
    for (double& number : row) number /= all;
  return sum;
}

build::Result<void> skin(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                         const std::vector<Transform>& joints, Vectors& positions, GltfPart& part) {
  const auto influences = read_influences(model, primitive, positions.size(), joints.size());
  if (!influences) return tl::unexpected(influences.error());
  for (std::size_t vertex = 0; vertex < positions.size(); ++vertex) {
    if (interrupted_at(vertex)) return cancelled();
    const auto transform = blended(*influences, vertex, joints);
    if (!transform) continue;
    const std::array<double, 3> p = positions[vertex];
    for (std::size_t row = 0; row < 3; ++row) {
      const auto& m = transform->m[row];
      positions[vertex][row] = m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3];
    }
    if (!part.normals.empty()) part.normals[vertex] = NormalTransform(*transform)(part.normals[vertex]);
  }
  return {};
}

/// The inverse bind matrices; identities if the skin names none.
build::Result<std::vector<Transform>> inverse_binds(const tinygltf::Model& model, const tinygltf::Skin& skin) {
  std::vector<Transform> result(skin.joints.size());
  if (skin.inverseBindMatrices < 0) return result;
  const auto values = read_matrices(model, skin.inverseBindMatrices);
  if (!values) return tl::unexpected(values.error());
  if (values->size() < result.size())
    return invalid_input("inverseBindMatrices has " + std::to_string(values->size()) + " elements for " +
                         std::to_string(result.size()) + " joints");
  std::copy_n(values->begin(), result.size(), result.begin());
  return result;
}

build::Result<std::vector<Transform>> joints_of(const tinygltf::Model& model, const std::vector<Transform>& to_world,
                                                int number) {
  const std::string location = "skin " + std::to_string(number) + ": ";
  if (static_cast<std::size_t>(number) >= model.skins.size())
    return invalid_input(location + "it does not exist; there are " + std::to_string(model.skins.size()));
  const tinygltf::Skin& skin = model.skins[static_cast<std::size_t>(number)];
  auto joints = inverse_binds(model, skin);
  if (!joints) return invalid_input(location + joints.error().message);
  for (std::size_t i = 0; i < joints->size(); ++i) {
    const int node = skin.joints[i];
    if (node < 0 || static_cast<std::size_t>(node) >= to_world.size())
      return invalid_input(location + "joint " + std::to_string(i) + " is node " + std::to_string(node) +
                           ", which does not exist");
    (*joints)[i] = to_world[static_cast<std::size_t>(node)] * (*joints)[i];
  }
  return joints;
}

}  // namespace

std::vector<bool> own_shapes(const tinygltf::Model& model) {
  std::vector<bool> result;
  for (const tinygltf::Node& node : model.nodes) result.push_back(node.skin >= 0 || !node.weights.empty());
  for (const tinygltf::Animation& animation : model.animations)
    for (const tinygltf::AnimationChannel& channel : animation.channels)
      if (channel.target_path == "weights" && channel.target_node >= 0 &&
          static_cast<std::size_t>(channel.target_node) < result.size())
        result[static_cast<std::size_t>(channel.target_node)] = true;
  return result;
}

build::Result<GltfDeformation> deformation_of(const tinygltf::Model& model, const std::vector<Transform>& to_world,
                                              int node) {
  const tinygltf::Node& own = model.nodes[static_cast<std::size_t>(node)];
  GltfDeformation result{own.weights, {}};
  if (result.weights.empty()) result.weights = model.meshes[static_cast<std::size_t>(own.mesh)].weights;
  for (const double weight : result.weights)
    if (!std::isfinite(weight))
      return invalid_input("node " + std::to_string(node) + ": a weight of a morph target is not finite");
  if (own.skin < 0) return result;
  auto joints = joints_of(model, to_world, own.skin);
  if (!joints) return tl::unexpected(joints.error());
  result.joints = std::move(*joints);
  return result;
}

build::Result<void> deform(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                           const GltfDeformation& deformation, GltfPart& part) {
  const bool is_skinned = !deformation.joints.empty() && primitive.attributes.contains("JOINTS_0");
  const bool morphs = !primitive.targets.empty() && std::any_of(deformation.weights.begin(), deformation.weights.end(),
                                                                [](double w) { return w != 0; });
  if (!is_skinned && !morphs) return {};
  Vectors positions = to_double(part.positions);
  if (auto done = add_targets(model, primitive, "POSITION", deformation.weights, positions); !done) return done;
  if (!part.normals.empty()) {
    Vectors normals = to_double(part.normals);
    if (auto done = add_targets(model, primitive, "NORMAL", deformation.weights, normals); !done) return done;
    std::transform(normals.begin(), normals.end(), part.normals.begin(), rounded);
  }
  if (is_skinned)
    if (auto done = skin(model, primitive, deformation.joints, positions, part); !done) return done;
  std::transform(positions.begin(), positions.end(), part.positions.begin(), rounded);
  return {};
}

}  // namespace hiprt::tools
