#pragma once
/// The manifest of a scene in parts: a JSON file that names the parts and says where they are.
///
///     {"format": "hiprt parts", "version": 1, "levels": 1, "instances": 1000, "materials": true,
///      "parts": [PART, ...], "shared": PART}
///
/// PART, FILE and BOX stand for:
///
///     {"bvh": FILE, "data": FILE, "instances": 500, "bounds": BOX, "condition": 1.5, "reach": 12, "boxes": [BOX]}
///
///     {"name": "city.0.bvh", "bytes": 123456, "xxh3": "32 hexadecimal digits"}
///
///     [min x, min y, min z, max x, max y, max z]
///
/// Each part is a BVH file of some of the scene's instances, and a file of data (part_data.h). "shared" is the part
/// that every process has: the objects with triangles that emit. File names are relative to the manifest's folder.

#include <tools/base/digest.h>

#include <hiprt_build/error.h>
#include <hiprt_device/format/node.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hiprt::tools {

/// Limits of a manifest.
inline constexpr std::size_t kMostParts = 65536, kMostPartBoxes = 64;

/// A file of a part.
struct PartFile {
  std::string name;  ///< Relative to the folder of the manifest.
  std::uint64_t bytes = 0;
  std::string checksum;  ///< to_text() of the digest of its bytes.
};

struct ScenePart {
  PartFile bvh, data;
  std::uint64_t instances = 0;           ///< Of the scene or of opened groups, that are in the part.
  Box bounds{};                          ///< Of no use if there are no boxes: nothing can be hit.
  float condition = 0.0f, reach = 0.0f;  ///< As in the header of its BVH file.
  std::vector<Box> boxes;                ///< Every hit in the part is in one of them, also while it moves.

  std::uint64_t bytes() const { return bvh.bytes + data.bytes; }
};

struct PartManifest {
  std::string path;             ///< Of the manifest, for messages and as the base of file names.
  std::uint32_t levels = 1;     ///< Of instances, in the part with the most.
  std::uint64_t instances = 0;  ///< In all parts.
  bool materials = false;       ///< Whether the parts have materials; else everything is clay.
  std::vector<ScenePart> parts;
  std::optional<ScenePart> shared;

  /// Of all parts.
  Box bounds() const;
  /// The path of a part's file.
  std::string path_of(const PartFile& file) const;
};

/// Whether a file is a manifest and no BVH file, by its name: it ends with .json. Inputs are read once, so the content
/// cannot tell.
bool is_part_manifest(std::string_view path);

/// @param path for messages and file names.
/// @return kInvalidInput with the location: "city.json: parts[2].boxes[1]: ...".
build::Result<PartManifest> parse_part_manifest(std::string_view text, const std::string& path);

std::string to_json(const PartManifest& manifest);

}  // namespace hiprt::tools
