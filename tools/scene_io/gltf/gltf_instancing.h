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

/// Where a node has its mesh, in the node's space: once, as it is, without the extension.
/// @return kInvalidInput with the node, the attribute and the instance.
build::Result<std::vector<Transform>> gpu_instances(const tinygltf::Model& model, int node);

}  // namespace hiprt::tools
