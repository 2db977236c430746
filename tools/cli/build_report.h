#pragma once
/// What bvhbuild says of what it has built.

#include <tools/build/build_meshes.h>
#include <tools/build/build_scene.h>
#include <tools/scene_io/scene/scene_description.h>

#include <hiprt_build/format/view.h>

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace hiprt::tools {

/// Of work around the build.
struct BuildSeconds {
  double read = 0, write = 0;
};

std::string report_text(const std::string& output, const Built& built, const BufferView& view, BuildSeconds seconds);
nlohmann::json report_json(const std::string& output, const Built& built, const BufferView& view, BuildSeconds seconds);

/// Of scenes of instances. Figures of the tree are those of the scene's own.
/// @param description what was built, maybe without its meshes.
std::string report_text(const std::string& output, const SceneDescription& description, const BuiltScene& built,
                        const BufferView& view, BuildSeconds seconds);
nlohmann::json report_json(const std::string& output, const SceneDescription& description, const BuiltScene& built,
                           const BufferView& view, BuildSeconds seconds);

}  // namespace hiprt::tools
