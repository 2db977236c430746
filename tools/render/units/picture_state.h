#pragma once
/// The state of all pixels of a picture, and how many steps each tile has.

#include <tools/render/units/picture_work.h>

#include <cstring>
#include <vector>

namespace hiprt::tools {

/// Tiles of equal size, row by row; the last ones of a row or column may be smaller.
struct PictureGrid {
  std::uint32_t width, height;  ///< Of the picture, in pixels.
  std::uint32_t tile;           ///< Side of a tile.

  std::uint32_t columns() const { return (width + tile - 1) / tile; }
  std::uint32_t rows() const { return (height + tile - 1) / tile; }
  std::uint32_t tiles() const { return columns() * rows(); }
  /// @return steps of @p count tiles of one row, from tile @p first_tile on.
  PictureUnit unit(std::uint32_t first_tile, std::uint32_t count, std::uint32_t first, std::uint32_t steps) const {
    const std::uint32_t left = first_tile % columns() * tile, top = first_tile / columns() * tile;
    return {left, top, smaller(count * tile, width - left), smaller(tile, height - top), first, steps};
  }
  friend bool operator==(const PictureGrid&, const PictureGrid&) = default;

 private:
  static std::uint32_t smaller(std::uint32_t a, std::uint32_t b) { return a < b ? a : b; }
};

/// @return the grid that gives every worker several tiles, if the picture has so many pixels.
inline PictureGrid choose_grid(std::uint32_t width, std::uint32_t height, unsigned workers) {
  constexpr std::uint32_t kLargest = 32, kSmallest = 8, kTilesPerWorker = 8;
  PictureGrid grid{width, height, kLargest};
  while (grid.tile > kSmallest && grid.tiles() < std::uint64_t{kTilesPerWorker} * workers) grid.tile /= 2;
  return grid;
}

struct PictureState {
  PictureState(const PictureGrid& of_picture, std::size_t bytes_per_pixel)
      : grid(of_picture),
        pixel_bytes(bytes_per_pixel),
        pixels(std::size_t{grid.width} * grid.height * pixel_bytes),
        done(grid.tiles()) {}

  /// @return the state of the unit's pixels; of the size alone if no step was done.
  std::vector<std::byte> cut(const PictureUnit& unit) const {
    std::vector<std::byte> part(unit.pixels() * pixel_bytes);
    if (unit.first == 0) return part;
    for (std::uint32_t y = 0; y < unit.height; ++y)
      std::memcpy(part.data() + y * unit.width * pixel_bytes, pixels.data() + offset(unit, y),
                  unit.width * pixel_bytes);
    return part;
  }
  /// @param part of the unit's size.
  void paste(const PictureUnit& unit, std::span<const std::byte> part) {
    for (std::uint32_t y = 0; y < unit.height; ++y)
      std::memcpy(pixels.data() + offset(unit, y), part.data() + y * unit.width * pixel_bytes,
                  unit.width * pixel_bytes);
  }

  /// Counts the unit's steps as done.
  void advance(const PictureUnit& unit) {
    const std::uint32_t first = unit.top / grid.tile * grid.columns() + unit.left / grid.tile;
    for (std::uint32_t x = 0; x < unit.width; x += grid.tile) done[first + x / grid.tile] = unit.first + unit.steps;
  }

  PictureGrid grid;
  std::size_t pixel_bytes;
  std::vector<std::byte> pixels;    ///< Row by row; zeros before the first step.
  std::vector<std::uint32_t> done;  ///< Steps, per tile.
  RayCounts rays;
  double seconds = 0.0;  ///< Of the computation so far, in all its runs.

 private:
  std::size_t offset(const PictureUnit& unit, std::uint32_t row) const {
    return (std::size_t{unit.top + row} * grid.width + unit.left) * pixel_bytes;
  }
};

}  // namespace hiprt::tools
