#pragma once
/// The node graph of a glTF file, flattened.

#include <tools/scene_io/transform.h>

#include <vector>

namespace tinygltf {
class Model;
}

namespace hiprt::tools {

struct NodeMesh {
  int node, mesh;
  Transform to_world;
};

/// Lists every use of a mesh in the default scene, depth first in the order of the file. If the file names no default
/// scene, its first scene is used; without scenes, all root nodes are used. A skinned mesh has no transform.
/// @param model checked by check_gltf().
/// @return kInvalidInput with the node's number if a node or mesh does not exist, a rotation is invalid, or a node is
/// reached twice (a cycle).
build::Result<std::vector<NodeMesh>> flatten(const tinygltf::Model& model);

/// From the space of every node to the world, whether the default scene has the node or not. Nodes in a cycle have the
/// identity.
/// @return kInvalidInput with the node's number if a rotation is invalid.
build::Result<std::vector<Transform>> world_transforms(const tinygltf::Model& model);

}  // namespace hiprt::tools
