#pragma once
/// The picture of a distance field on a plane across an axis.

#include <tools/cli/render/picture_options.h>
#include <tools/render/image/image.h>
#include <tools/scene_io/query_file.h>

#include <hiprt_device/format/node.h>
#include <hiprt_device/math/vec.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace hiprt::tools {

/// "z" or "z=0.5" of a command line.
struct SlicePlane {
  unsigned axis = 2;              ///< 0 to 2: x to z.
  std::optional<float> position;  ///< Along the axis. Nothing: the middle of the scene.
};

std::optional<SlicePlane> parse_plane(std::string_view text);
/// CLI11 validator: an empty string, or what is wrong.
std::string check_plane(const std::string& text);

/// Where the pixels of a slice are. Pixels are squares; their picture shows the whole scene with a margin.
///
/// The other two axes are those of the picture, in the order x, y, z: the first to the right, the second upwards.
class SliceGrid {
 public:
  SliceGrid(const Box& bounds, const SlicePlane& plane, const PictureSize& size);

  PictureSize size() const { return size_; }
  unsigned axis() const { return axis_; }
  unsigned right() const { return axis_ == 0 ? 1 : 0; }
  unsigned up() const { return axis_ == 2 ? 1 : 2; }
  /// Of the pixels' sides.
  double step() const { return step_; }
  double position() const { return position_; }
  /// The centre of a pixel. @param y 0: the top row.
  Vec3 at(std::uint32_t x, std::uint32_t y) const;
  /// The centres, row by row.
  QueryBatch points() const;

 private:
  PictureSize size_;
  unsigned axis_;
  double step_, position_;
  double left_, top_;  ///< Centre of the first pixel.
};

/// What the picture shows.
struct SliceScale {
  float nearest = 0, farthest = 0;  ///< The range of the finite distances, with sign.
  float contours = 0;               ///< The distance between two lines. 0: there are none.
};

/// @param records of the grid's points. @return a round number: the picture has about ten lines.
SliceScale scale_of(std::span<const PointRecord> records);

/// Orange outside, blue inside, darker with the distance; lines of equal distance, and the surface in white. Grey where
/// nothing was found. Layers of the picture: depth is the distance, position the closest point, and the primitive.
Image draw_slice(const SliceGrid& grid, std::span<const PointRecord> records, const SliceScale& scale);

}  // namespace hiprt::tools
