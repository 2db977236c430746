#pragma once
/// From the description of a scene to its file.

#include <tools/cli/build_command.h>
#include <tools/cli/progress.h>
#include <tools/scene_io/scene/scene_description.h>

#include <hiprt_build/build.h>

#include <string_view>

namespace hiprt::tools {

struct BuiltScene {
  build::Buffer file;
  build::Builder builder;          ///< Of the objects' trees, that was asked for.
  build::BuildStatistics objects;  ///< Sums of all objects' figures; scratch_bytes_peak: the largest.
  std::size_t other_builder = 0;   ///< Objects whose tree another builder made, as the asked one gave up.
  std::size_t built_objects = 0;
  bool on_gpu = false;  ///< Objects; trees over instances are always the CPU's.
  double object_seconds = 0, instance_seconds = 0;
};

/// Builds the objects, small ones many at a time, then the trees over instances. The meshes and shapes of @p scene are
/// given up.
/// @param tool for the provenance.
build::Result<BuiltScene> build_scene(SceneDescription& scene, const BuildCommand& command, std::string_view tool,
                                      ProgressBar& bar);

}  // namespace hiprt::tools
