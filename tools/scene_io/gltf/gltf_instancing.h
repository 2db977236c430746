#pragma once
/// EXT_mesh_gpu_instancing: a node that has its mesh many times.

#include <tools/scene_io/transform.h>

#include <hiprt_build/error.h>

#include <string_view>
#include <vector>

namespace tinygltf {
class Model;
}

namespace hiprt::tools {

inline constexpr std::string_view kGpuInstancing = "EXT_mesh_gpu_instancing";

/// The instances of a node's mesh, in the node's space. Without the extension: one, the identity.
/// @return kInvalidInput with the node, the attribute and the instance.
build::Result<std::vector<Transform>> gpu_instances(const tinygltf::Model& model, int node);

}  // namespace hiprt::tools
