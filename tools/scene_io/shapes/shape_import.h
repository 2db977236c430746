#pragma once
/// Spheres and curves from files.

#include <hiprt_build/error.h>
#include <hiprt_build/input.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace hiprt::tools {

/// Spheres, or the segments of strands: one geometry.
struct ShapeSet {
  std::string name{};  ///< The file's name without its folder, or the location in a description.
  std::string path{};  ///< Of the file; empty if a description has the shapes itself.
  ShapeKind kind = ShapeKind::kNone;
  std::vector<ShapePoint> points{};       ///< Finite, radii at least 0.
  std::vector<std::uint32_t> segments{};  ///< Of curves: first points, strand by strand.
  std::uint64_t strands = 0;              ///< Of curves; those of one point have no segment.

  build::Shapes view() const { return {kind, points, segments}; }
  std::size_t size() const { return view().size(); }
};

/// A file of shapes by its name: .hair or .xyzr. In any case of the letters.
bool is_shape_file(const std::string& path);

/// Reads a whole file, the format by its extension:
/// - .hair (Cem Yuksel, http://www.cemyuksel.com/research/hairmodels/): little-endian; a header of 128 bytes: "HAIR",
///   u32 strands, u32 points of all strands, u32 arrays that there are (bits: 0 segments, 1 points, 2 thickness, 3
///   transparency, 4 colour), u32 default segments, f32 default thickness, f32 default transparency, f32[3] default
///   colour, char[88] text; then the arrays: u16 segments per strand, f32[3] per point, f32 thickness per point, f32
///   transparency per point, f32[3] colour per point. Thickness is the diameter: a radius is half of it. Transparency
///   and colour are not read.
/// - .xyzr: text, a sphere per line: x y z radius. Empty lines, and what follows a #, do not matter.
/// @return kIo; kInvalidInput with path, location and limit; kTooLarge, kOutOfMemory, kCancelled when interrupted()
/// became true. Never throws.
build::Result<ShapeSet> load_shapes(const std::filesystem::path& path);

/// The bytes of a .hair file. @param points of each strand, 1 to 65536. @param shapes of all strands, one after the
/// other. @param text of at most 87 bytes.
std::vector<std::byte> hair_file(std::span<const std::uint32_t> points, std::span<const ShapePoint> shapes,
                                 const std::string& text);

/// Why a point is none: "radius -1"; empty for a good one.
std::string shape_point_fault(const ShapePoint& point);

}  // namespace hiprt::tools
