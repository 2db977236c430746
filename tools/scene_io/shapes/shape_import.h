#pragma once
/// Spheres and curves from files, and triangles that move.

#include <tools/scene_io/mesh/mesh_surface.h>

#include <hiprt_build/error.h>
#include <hiprt_build/input.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace hiprt::tools {

/// Spheres, the segments of strands, or triangles that move: one geometry.
struct ShapeSet {
  std::string name{};  ///< The file's name without its folder, or the location in a description.
  std::string path{};  ///< Of the file; empty if a description has the shapes itself.
  ShapeKind kind = ShapeKind::kNone;
  std::vector<ShapePoint> points{};       ///< Finite, radii at least 0. Of triangles: with times as build::Shapes says.
  std::vector<std::uint32_t> segments{};  ///< Of curves: first points, strand by strand. Of triangles: corners.
  std::uint64_t strands = 0;              ///< Of curves; a strand of one point has no segment.
  std::uint32_t keys = 0;                 ///< Of triangles: their times.
  std::optional<MeshSurface> surface{};   ///< Of triangles, if it was requested.
  std::vector<std::string> warnings{};    ///< What of the file was ignored, a line each.

  build::Shapes view() const { return {kind, points, segments, keys}; }
  std::size_t size() const { return view().size(); }
};

/// @return whether a file has shapes, by its extension: .hair or .xyzr, in upper or lower case.
bool is_shape_file(const std::string& path);

/// Reads a whole file. The extension tells the format:
/// - .hair (Cem Yuksel, http://www.cemyuksel.com/research/hairmodels/): little-endian, see below. Thickness is the
///   diameter: a radius is half of it. Transparency and colour are not read; a warning counts them.
/// - .xyzr: text, a sphere per line: x y z radius. Empty lines, and text after a #, are ignored.
///
/// A .hair file has a header of 128 bytes, then the arrays whose bits are set in the header:
///     char[4] "HAIR", u32 strands, u32 points of all strands, u32 bits of the arrays that follow,
///     u32 default segments, f32 default thickness, f32 default transparency, f32[3] default colour, char[88] text
///     bit 0: u16 segments per strand
///     bit 1: f32[3] position per point
///     bit 2: f32 thickness per point
///     bit 3: f32 transparency per point
///     bit 4: f32[3] colour per point
/// @return kIo; kInvalidInput with path, location and limit; kTooLarge, kOutOfMemory, kCancelled when interrupted()
/// became true. Never throws.
build::Result<ShapeSet> load_shapes(const std::filesystem::path& path);

/// @return the bytes of a .hair file. @param points number of points of each strand, 1 to 65536. @param shapes of all
/// strands, one after the other. @param text of at most 87 bytes.
std::vector<std::byte> hair_file(std::span<const std::uint32_t> points, std::span<const ShapePoint> shapes,
                                 const std::string& text);

/// @return why a point is invalid ("radius -1"); empty for a valid point.
std::string shape_point_fault(const ShapePoint& point);

}  // namespace hiprt::tools
