#pragma once
/// What a part of a scene has beside its BVH file: the numbers of its instances in the scene, and surfaces.
///
///     "HIPRTPRT"            8 bytes
///     version               4 bytes, little-endian, as all numbers
///     whether it has surfaces  1 byte
///     groups                their count (8 bytes), then for each the count and the numbers of its instances
///     textures, materials, objects with their geometries (part_data.cpp)

#include <tools/scene_io/surface/surface.h>

#include <hiprt_build/error.h>
#include <hiprt_build/format/view.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace hiprt::tools {

struct PartData {
  /// For each group of the BVH file, and last for its scene: instance i is instance groups[g][i] of the whole scene's
  /// group. Ascending. Empty: the numbers are the same.
  std::vector<std::vector<std::uint32_t>> groups;
  std::optional<SceneSurfaces> surfaces{};  ///< Of the part's objects; nothing: they are clay.
};

std::vector<std::byte> encode(const PartData& data);

/// @param bvh the part's file, accepted by validate(): objects, geometries and primitives must have the numbers of it.
/// @return kInvalidInput with what is wrong. No number of a result leads out of an array. Throws std::bad_alloc.
build::Result<PartData> decode_part_data(std::span<const std::byte> bytes, const BufferView& bvh);

}  // namespace hiprt::tools
