#pragma once
/// The node graph of a glTF file, flattened.

#include <hiprt_build/error.h>
#include <hiprt_build/input.h>

#include <array>
#include <vector>

namespace tinygltf {
class Model;
}

namespace hiprt::tools {

/// 4 x 4 without its last row (0, 0, 0, 1): m[row][column].
struct Transform {
  std::array<std::array<double, 4>, 3> m{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

  /// Computed in double and rounded once.
  build::Position operator()(const build::Position& p) const;
  /// First @p inner, then this one.
  Transform operator*(const Transform& inner) const;
  /// Does it turn the outside of a mesh inside?
  bool mirrors() const;
};

struct MeshUse {
  int mesh;
  Transform to_world;
};

/// Every use of a mesh below the roots of the default scene (the first scene if none is named; all root nodes if there
/// is no scene), depth first in the order of the file.
/// A skinned mesh has no transform.
/// @param model checked by check_gltf().
/// @return kInvalidInput with the node's number if a node or mesh does not exist, a rotation is none, or a node is
/// reached twice (a cycle).
build::Result<std::vector<MeshUse>> flatten(const tinygltf::Model& model);

}  // namespace hiprt::tools
