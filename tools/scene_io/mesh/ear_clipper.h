#pragma once
/// Triangulation of polygons of any shape and size.

#include <hiprt_build/input.h>

#include <array>
#include <cstdint>
#include <queue>
#include <span>
#include <vector>

namespace hiprt::tools {

using PlanePoint = std::array<double, 2>;

/// Twice the signed area of a triangle.
double area2(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c);

/// The corners of a polygon that are not clipped yet, by place: a grid with about as many cells as corners.
class CornerGrid {
 public:
  explicit CornerGrid(std::span<const PlanePoint> points) : points_(points), next_(points.size()) {}

  /// Puts all corners with alive[i] into the grid.
  void fill(const std::vector<bool>& alive);

  /// @return the first corner for which blocks(i) is true, of those in the cells around a triangle; points.size():
  /// none.
  template <class Blocks>
  std::uint32_t find(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c, const Blocks& blocks) const;

 private:
  static constexpr std::uint32_t kEnd = 0xffffffffu;

  std::size_t cell(unsigned axis, double at) const;

  std::span<const PlanePoint> points_;
  PlanePoint low_{}, cells_per_unit_{};
  std::array<std::size_t, 2> cells_{1, 1};  ///< Per axis.
  std::vector<std::uint32_t> first_;        ///< Corner of each cell, then next_ of it.
  std::vector<std::uint32_t> next_;
};

/// Clips ears off a polygon (Meisters 1975): of all corners that are ears, always the first. A corner is an ear if the
/// polygon is convex there and no other corner is inside its triangle. A corner that was found inside blocks the ear
/// until it is clipped itself. The time grows with the
/// number of corners while ears are small, with its square at worst.
class EarClipper {
 public:
  /// @param points finite, counter-clockwise. @param corners vertex numbers of the points.
  EarClipper(std::span<const PlanePoint> points, std::span<const std::uint32_t> corners);

  /// Appends points.size() - 2 triangles. Ends early when interrupted.
  void run(std::vector<build::Triangle>& triangles);

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  struct Corner {
    std::uint32_t before, after;    ///< Its remaining neighbours.
    std::uint32_t blocker = kNone;  ///< A corner in its triangle, if one is known.
    bool is_ear = false;
  };

  void examine(std::uint32_t at);
  std::uint32_t next_ear();
  void clip(std::uint32_t at, std::vector<build::Triangle>& triangles);

  std::span<const PlanePoint> points_;
  std::span<const std::uint32_t> corners_;
  std::vector<Corner> ring_;
  std::vector<bool> alive_;
  std::size_t left_, in_grid_;  ///< Corners that are alive; those when the grid was filled.
  CornerGrid grid_;
  std::uint32_t first_ = 0;  ///< No corner before it is alive.
  std::priority_queue<std::uint32_t, std::vector<std::uint32_t>, std::greater<>> ears_;  ///< Some are ears no more.
  std::vector<std::vector<std::uint32_t>> waiting_;  ///< Per corner: the corners that it blocks or blocked once.
};

}  // namespace hiprt::tools
