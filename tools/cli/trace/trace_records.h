#pragma once
/// Converts hits to the records of hit files and path files.

#include <tools/scene_io/rays_file.h>

#include <hiprt_build/error.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/scene_view.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace hiprt::tools {

/// Whether a hit file can number the primitives of a file and of each of its objects. @return kTooLarge with the path,
/// the object, its primitives, and the limit.
build::Result<void> check_primitive_counts(const std::filesystem::path& path, const BufferView& view);

/// The number of a primitive in hit files (rays_file.h).
/// @param path scene.levels entries.
std::uint32_t primitive_number(const SceneView& scene, std::span<const std::uint32_t> path, std::uint32_t geometry,
                               std::uint32_t primitive);

/// @param paths of trace(): scene.levels per hit.
/// @return kInvalidInput if the tracer refused the scene.
build::Result<std::vector<HitRecord>> hit_records(const SceneView& scene, std::span<const Hit> hits,
                                                  std::span<const std::uint32_t> paths);

/// scene.levels for every scene.levels of @p paths.
std::vector<PathRecord> path_records(const SceneView& scene, std::span<const std::uint32_t> paths);

}  // namespace hiprt::tools
