#pragma once
/// Builds one BVH over meshes and shapes, on the CPU or the GPU.

#include <tools/build/build_request.h>
#include <tools/scene_io/mesh/mesh_import.h>

#include <hiprt_build/exchange.h>

#include <optional>
#include <span>
#include <vector>

namespace hiprt::tools {

struct Built {
  build::Bvh bvh;
  build::Builder builder;  ///< The requested one. The statistics say which builder made the tree.
  bool on_gpu;
};

/// @param tree imported tree to encode instead of building one.
build::Result<Built> build_meshes(const build::SceneInput& scene, const BuildRequest& request,
                                  const std::optional<build::ExchangeBvh>& tree = {});

/// Views of @p meshes for the builder. The meshes must outlive them.
std::vector<build::TriangleMesh> views(std::span<const Mesh> meshes);
build::TriangleMesh view_of(const Mesh& mesh);

}  // namespace hiprt::tools
