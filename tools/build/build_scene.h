#pragma once
/// Builds the file of a scene of instances from its description.

#include <tools/base/progress_sink.h>
#include <tools/build/build_request.h>
#include <tools/scene_io/scene/scene_description.h>

namespace hiprt::tools {

struct BuiltScene {
  build::Buffer file;
  build::Builder builder;          ///< The requested one, of the objects' trees.
  build::BuildStatistics objects;  ///< Sums over all objects; scratch_bytes_peak is the largest one.
  std::size_t other_builder = 0;   ///< Objects whose tree another builder made because the requested one gave up.
  std::size_t built_objects = 0;
  bool on_gpu = false;  ///< Where objects were built. The CPU always builds the trees over instances.
  double object_seconds = 0, instance_seconds = 0;
};

/// Builds the objects (small ones in parallel), then the trees over instances. Frees the meshes and shapes of @p scene
/// in between.
build::Result<BuiltScene> build_scene(SceneDescription& scene, const BuildRequest& request,
                                      const ProgressSink& progress);

}  // namespace hiprt::tools
