#pragma once
/// Reads materials and vertex attributes from the files that a BVH was built from.

#include <tools/scene_io/surface/surface.h>

#include <hiprt_build/buffer.h>
#include <hiprt_build/error.h>
#include <hiprt_build/format/view.h>

#include <span>
#include <string>

namespace hiprt::tools {

/// Reads the inputs of bvhbuild again, in the same order: files of meshes and shapes (with or without --instances or
/// --flatten), or one scene file. Geometries, triangles and corners have the numbers that hits have. If bvhbuild
/// swapped corners of a mirrored triangle, they are swapped here, too. Normals are in the space of the vertices: that
/// of the object, or of the scene if the BVH has no instances. Groups of instances are objects without geometries.
///
/// Read from glTF 2.0: pbrMetallicRoughness, emission with KHR_materials_emissive_strength, alphaMode (BLEND: cutoff
/// 0.5) and normals. Textures are read from PNG and JPEG images, with TEXCOORD_0 and KHR_texture_transform. Not read
/// and named in the warnings: vertex colours, normal maps, other sets of coordinates, other material extensions. A
/// primitive without material has the standard's default (white, metallic 1, roughness 1). Images are read only if a
/// triangle has a material with them, each once per file. Files of other formats, spheres and curves have a material
/// "clay" without textures.
/// @param bvh of the file to trace; its content is trusted (validate()).
/// @param output file that will be written. It must not be one of the files that are read. Empty: no file.
/// @return kInvalidInput if the files do not match the BVH: "a.glb: geometry 0 has 12 triangles, that of the BVH 14
/// triangles". kInvalidInput also if their content is wrong, with file, material and location. Else kIo, kTooLarge
/// (limits in picture.h and material_library.h), kOutOfMemory or kCancelled.
build::Result<SceneSurfaces> load_surfaces(std::span<const std::string> inputs, const BufferView& bvh,
                                           const std::string& output = {});

/// The same for the BVH files of a scene's objects, without trees over instances.
build::Result<SceneSurfaces> load_surfaces(std::span<const std::string> inputs, std::span<const build::Buffer> objects,
                                           const std::string& output = {});

}  // namespace hiprt::tools
