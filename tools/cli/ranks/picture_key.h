#pragma once
/// What the bits of a picture of bvhrender depend on.

#include <tools/cli/render/render_command.h>
#include <tools/render/units/checkpoint.h>

namespace hiprt::tools {

/// @param version of the program, e.g. "bvhrender 0.2.0". @param scene bytes of the BVH file.
PictureKey picture_key(const std::string& version, std::span<const std::byte> scene, const RenderCommand& command,
                       const Camera& camera);

}  // namespace hiprt::tools
