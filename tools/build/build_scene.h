#pragma once
/// Builds the file of a scene of instances from its description.

#include <tools/base/progress_sink.h>
#include <tools/build/build_meshes.h>
#include <tools/build/build_request.h>
#include <tools/scene_io/scene/scene_description.h>

#include <cstdint>
#include <tuple>
#include <vector>

namespace hiprt::tools {

/// How the cache was used. With no cache all counts are 0.
struct CacheCounts {
  std::size_t hits = 0, misses = 0, damaged = 0;
  std::string first_damage{};      ///< What is wrong with a damaged entry.
  std::string first_not_stored{};  ///< Why an entry was not written; empty: all were.
};

struct BuiltScene {
  build::Buffer file;
  build::Builder builder;          ///< The requested one, of the objects' trees.
  build::BuildStatistics objects;  ///< Sums over all objects; scratch_bytes_peak is the largest one.
  std::size_t other_builder = 0;   ///< Objects whose tree another builder made because the requested one gave up.
  std::size_t built_objects = 0;
  bool on_gpu = false;  ///< Where objects were built. The CPU always builds the trees over instances.
  double object_seconds = 0, instance_seconds = 0;
  CacheCounts cache{};
};

/// build_meshes(), through the cache if @p request has one.
/// @param counts gets one more.
build::Result<Built> build_or_reuse(const build::SceneInput& scene, const BuildRequest& request, CacheCounts& counts);

/// Builds the files of all objects, small ones in parallel, and counts them in @p result. Then it frees the meshes and
/// shapes of @p scene.
build::Result<std::vector<build::Buffer>> build_objects(SceneDescription& scene, const BuildRequest& request,
                                                        const ProgressSink& progress, BuiltScene& result);

/// Some instances of a scene and of its groups, as a scene of their own.
struct SceneSelection {
  /// Some instances of a group of the scene.
  struct Group {
    std::size_t original = 0;              ///< Index in SceneDescription::groups.
    std::vector<std::uint32_t> instances;  ///< Of the original, ascending.
    std::vector<std::uint32_t> objects;    ///< Of each instance: first come `files`, then `groups`.

    friend bool operator<(const Group& a, const Group& b) {
      return std::tie(a.original, a.instances, a.objects) < std::tie(b.original, b.instances, b.objects);
    }
  };
  std::vector<std::uint32_t> files;  ///< Objects with geometries, ascending.
  std::vector<Group> groups;         ///< They have objects of lower numbers. The last one is the scene.
};

/// Builds the trees over the selected instances.
/// @param files of build_objects(). @param on_gpu BuiltScene::on_gpu.
build::Result<build::Bvh> build_selection(const SceneDescription& scene, std::span<const build::Buffer> files,
                                          const SceneSelection& selection, bool on_gpu, const BuildRequest& request,
                                          const ProgressSink& progress);

/// Builds the objects, then the trees over instances. Frees the meshes and shapes of @p scene in between.
build::Result<BuiltScene> build_scene(SceneDescription& scene, const BuildRequest& request,
                                      const ProgressSink& progress);

}  // namespace hiprt::tools
