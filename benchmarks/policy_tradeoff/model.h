#pragma once
/// Meshes with the properties that the checks need, and their trees.

#include <hiprt_build/build.h>
#include <hiprt_build/error.h>
#include <hiprt_device/math/vec.h>
#include <tests/oracle/mesh.h>
#include <tools/scene_io/mesh/mesh_import.h>

#include <array>
#include <string>

namespace hiprt::bench {

inline constexpr std::size_t kLayouts = 4;

constexpr std::size_t layout_index(NodeLayout layout) { return static_cast<std::size_t>(layout) - 1; }

struct Model {
  std::string name;
  tools::Mesh mesh;
  Vec3 centre{0.0f};
  float room = 0.0f;    ///< See oracle::Target.
  float extent = 0.0f;  ///< See oracle::Target.
};

/// A closed mesh around the origin, scaled and moved. @param room radius of a ball inside the mesh before that.
Model make_model(std::string name, const oracle::Mesh& mesh, double room, double scale = 1.0,
                 const oracle::Double3& offset = {0, 0, 0});
/// A mesh that is only traced.
Model make_model(std::string name, tools::Mesh mesh);

/// The mesh's files in every layout (layout_index()), made by the default builder.
using Trees = std::array<build::Bvh, kLayouts>;
build::Result<Trees> build_trees(const Model& model);

}  // namespace hiprt::bench
