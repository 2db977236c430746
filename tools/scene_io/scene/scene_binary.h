#pragma once
/// Scenes of instances in one binary file with their meshes (.scene), little-endian:
///
///     u32 magic ("SCN1"), u32 number of objects; then the objects, the last of which is the scene:
///     mesh:  u32 0, u32 vertices, u32 triangles, vertices * f32[3], triangles * u32[3]
///     group: u32 1, u32 children, children * { u32 object, f32[12] matrix }
///
/// Children are objects with lower numbers; matrices are rows of 3 x 4 that take the child to the group.

#include <tools/scene_io/scene/scene_description.h>

#include <hiprt_build/error.h>

#include <filesystem>

namespace hiprt::tools {

/// Reads a scene with its meshes. Objects that the scene has no instance of are left out. Instances have their number
/// in the group as id.
/// @return kIo, kCancelled, kOutOfMemory, or kInvalidInput with the object and the limit.
build::Result<SceneDescription> read_scene_binary(const std::filesystem::path& path);

/// Writes a scene; masks and ids are not stored. The old file or the whole new one is there afterwards.
/// @pre every object has one mesh, and nothing moves.
/// @return kIo with path and reason.
build::Result<void> write_scene_binary(const std::filesystem::path& path, const SceneDescription& scene);

}  // namespace hiprt::tools
