#pragma once
/// Builds a scene in parts: a manifest and, next to it, the files of each part.

#include <tools/build/build_scene.h>
#include <tools/parts/part_manifest.h>
#include <tools/scene_io/surface/surface.h>

#include <functional>
#include <span>
#include <string>

namespace hiprt::tools {

struct PartsOptions {
  std::size_t parts = 2;
  std::string output;  ///< The manifest. Of "city.json" the files of part 3 are "city.3.bvh" and "city.3.data".
  /// Whether the objects' trees were built on the GPU: then it builds those over instances, too.
  bool on_gpu = false;
};

/// Whether a renderer without surfaces makes the same picture: all is clay, without normals and textures.
bool is_plain_clay(const SceneSurfaces& surfaces);

/// Divides the instances of the scene (split_scene.h). Groups that are large are opened first: their instances go to
/// different parts. Objects with triangles that emit become the shared part. Parts are built and written one after the
/// other, and the manifest last. If that fails, no new manifest names the files that are there.
/// @param files of build_objects(). @param surfaces of all objects; nullptr: everything is clay.
/// @return the manifest; kInvalidInput if there are fewer instances than parts; errors of build_selection() and
/// write_file().
build::Result<PartManifest> build_parts(const SceneDescription& scene, std::span<const build::Buffer> files,
                                        const SceneSurfaces* surfaces, const PartsOptions& options,
                                        const BuildRequest& request, const ProgressSink& progress);

}  // namespace hiprt::tools
