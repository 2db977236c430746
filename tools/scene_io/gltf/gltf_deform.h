#pragma once
/// Meshes that their nodes deform: morph targets and skins (glTF 2.0, 3.7.2.2 and 3.7.3).

#include <tools/scene_io/gltf/gltf_part.h>
#include <tools/scene_io/transform.h>

#include <hiprt_build/error.h>

#include <vector>

namespace tinygltf {
class Model;
struct Primitive;
}  // namespace tinygltf

namespace hiprt::tools {

/// How a node deforms its mesh.
struct GltfDeformation {
  std::vector<double> weights;    ///< Of the morph targets; empty: all 0.
  std::vector<Transform> joints;  ///< Of the skin, from the mesh to the world; empty: no skin.
};

/// For each node, whether it has a skin or morph weights, also animated ones. Then its mesh may have another shape than
/// for other nodes.
std::vector<bool> own_shapes(const tinygltf::Model& model);

/// The deformation by a node, as the model's nodes are posed now.
/// @param to_world of all nodes (world_transforms()).
/// @return kInvalidInput with the node or skin.
build::Result<GltfDeformation> deformation_of(const tinygltf::Model& model, const std::vector<Transform>& to_world,
                                              int node);

/// Deforms the positions of a part, and its normals if it has any. In double, rounded once. Weights of joints are
/// divided by their sum. A primitive without JOINTS_0 is not skinned.
/// @param part of the same primitive, as the file has it.
/// @return kInvalidInput with the attribute, the target or the vertex.
build::Result<void> deform(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                           const GltfDeformation& deformation, GltfPart& part);

}  // namespace hiprt::tools
