#pragma once
/// Materials and attributes of vertices of what a BVH file was built of.

#include <tools/scene_io/surface/surface.h>

#include <hiprt_build/error.h>
#include <hiprt_build/format/view.h>

#include <span>
#include <string>

namespace hiprt::tools {

/// Reads the files that bvhbuild was given for a BVH again, in the same order, for what they say of surfaces: files of
/// meshes and shapes of a BVH without instances (--flatten or not) or of one with (--instances), or one scene, .json or
/// .scene. Geometries, triangles and corners have the numbers of hits: where bvhbuild changed the order of a mirrored
/// triangle's corners, it is changed here. Normals are where the vertices are: in an object's own space, or in that of
/// a BVH without instances. Groups of instances are objects without geometries.
///
/// Of glTF 2.0: pbrMetallicRoughness, emission with KHR_materials_emissive_strength, alphaMode (BLEND: cutoff 0.5),
/// textures with TEXCOORD_0 and KHR_texture_transform, of PNG and JPEG images, and normals; not: colours of vertices,
/// normal maps, skins, other extensions of materials. A primitive without material has the standard's default (white,
/// metallic 1, roughness 1). Only images of materials that triangles have are read, each once per file. Files of other
/// formats, spheres and curves are of a material "clay" without textures.
/// @param bvh of the file to trace; its content is trusted (validate()).
/// @param output if not empty, a file that is to be written: it must be none of those that are read.
/// @return kInvalidInput: the files are not those of the BVH, with the numbers ("a.glb: geometry 0 has 12 triangles,
/// that of the BVH 14 triangles"), or wrong in themselves, with file, material and place; kIo, kTooLarge (pictures:
/// picture.h, material_library.h), kOutOfMemory, kCancelled.
build::Result<SceneSurfaces> load_surfaces(std::span<const std::string> inputs, const BufferView& bvh,
                                           const std::string& output = {});

}  // namespace hiprt::tools
