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

/// Every use of a mesh below the roots of the default scene (the first scene if none is named; all root nodes if there
/// is no scene), depth first in the order of the file.
/// A skinned mesh has no transform.
/// @param model checked by check_gltf().
/// @return kInvalidInput with the node's number if a node or mesh does not exist, a rotation is none, or a node is
/// reached twice (a cycle).
build::Result<std::vector<NodeMesh>> flatten(const tinygltf::Model& model);

}  // namespace hiprt::tools
