#pragma once
/// Compressed meshes of glTF: KHR_draco_mesh_compression and EXT_meshopt_compression.

#include <hiprt_build/error.h>

#include <nlohmann/json_fwd.hpp>

namespace tinygltf {
class Model;
}

namespace hiprt::tools {

/// Whether this build has the decoder: CMake looks for libdraco-dev and libmeshoptimizer-dev.
bool has_draco();
bool has_meshopt();

/// Replaces compressed bufferViews by decoded ones, in new buffers of the model.
/// @param document checked by check_gltf(). @param model of the same file.
/// @return kInvalidInput with the bufferView and the fault of its data.
build::Result<void> decode_meshopt(const nlohmann::json& document, tinygltf::Model& model);

/// Replaces the accessors of compressed primitives by decoded ones, in new buffers of the model.
/// @return kInvalidInput with the mesh, the primitive and the fault of its data.
build::Result<void> decode_draco(const nlohmann::json& document, tinygltf::Model& model);

}  // namespace hiprt::tools
