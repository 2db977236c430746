#pragma once
/// The report of bvhbuild.

#include <tools/build/build_meshes.h>
#include <tools/build/build_scene.h>
#include <tools/scene_io/scene/scene_description.h>

#include <hiprt_build/format/view.h>

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace hiprt::tools {

/// Times of the steps around the build.
struct BuildSeconds {
  double read = 0, write = 0;
};

std::string report_text(const std::string& output, const Built& built, const BufferView& view, BuildSeconds seconds);
nlohmann::json report_json(const std::string& output, const Built& built, const BufferView& view, BuildSeconds seconds);

/// The same for scenes of instances. The statistics are about the scene's own tree over instances.
/// @param description of the scene. Its meshes may be gone.
std::string report_text(const std::string& output, const SceneDescription& description, const BuiltScene& built,
                        const BufferView& view, BuildSeconds seconds);
nlohmann::json report_json(const std::string& output, const SceneDescription& description, const BuiltScene& built,
                           const BufferView& view, BuildSeconds seconds);

}  // namespace hiprt::tools
