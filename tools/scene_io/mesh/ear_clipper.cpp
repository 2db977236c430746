#include <tools/scene_io/mesh/ear_clipper.h>

#include <tools/base/interrupt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace hiprt::tools {

double area2(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

void CornerGrid::fill(const std::vector<bool>& alive) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  PlanePoint high{-kInfinity, -kInfinity};
  low_ = {kInfinity, kInfinity};
  std::size_t count = 0;
  for (std::size_t i = 0; i < alive.size(); ++i) {
    if (!alive[i]) continue;
    ++count;
    for (unsigned axis = 0; axis < 2; ++axis) {
      low_[axis] = std::min(low_[axis], points_[i][axis]);
      high[axis] = std::max(high[axis], points_[i][axis]);
    }
  }
  const double width = high[0] - low_[0], height = high[1] - low_[1], all = static_cast<double>(count);
  const double columns = width > 0 && height > 0 ? std::sqrt(all * width / height) : width > 0 ? all : 1.0;
  cells_[0] = static_cast<std::size_t>(std::clamp(columns, 1.0, all));
  cells_[1] = height > 0 ? std::max<std::size_t>(1, count / cells_[0]) : 1;
  cells_per_unit_ = {width > 0 ? static_cast<double>(cells_[0]) / width : 0.0,
                     height > 0 ? static_cast<double>(cells_[1]) / height : 0.0};
  first_.assign(cells_[0] * cells_[1], kEnd);
  for (std::size_t i = 0; i < alive.size(); ++i) {
    if (!alive[i]) continue;
    std::uint32_t& first = first_[cell(0, points_[i][0]) + cells_[0] * cell(1, points_[i][1])];
    next_[i] = std::exchange(first, static_cast<std::uint32_t>(i));
  }
}

/// It never falls as @p at grows. So the cells of a box are those between the cells of its ends.
std::size_t CornerGrid::cell(unsigned axis, double at) const {
  const double place = (at - low_[axis]) * cells_per_unit_[axis];
  return std::min(cells_[axis] - 1, static_cast<std::size_t>(std::max(0.0, place)));
}

template <class Blocks>
std::uint32_t CornerGrid::find(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c,
                               const Blocks& blocks) const {
  std::array<std::size_t, 2> begin{}, end{};
  for (unsigned axis = 0; axis < 2; ++axis) {
    begin[axis] = cell(axis, std::min({a[axis], b[axis], c[axis]}));
    end[axis] = cell(axis, std::max({a[axis], b[axis], c[axis]}));
  }
  for (std::size_t y = begin[1]; y <= end[1]; ++y)
    for (std::size_t x = begin[0]; x <= end[0]; ++x)
      for (std::uint32_t i = first_[x + cells_[0] * y]; i != kEnd; i = next_[i])
        if (blocks(i)) return i;
  return kEnd;
}

EarClipper::EarClipper(std::span<const PlanePoint> points, std::span<const std::uint32_t> corners)
    : points_(points),
      corners_(corners),
      ring_(points.size()),
      alive_(points.size(), true),
      left_(points.size()),
      in_grid_(points.size()),
      grid_(points),
      waiting_(points.size()) {
  const auto n = static_cast<std::uint32_t>(ring_.size());
  for (std::uint32_t i = 0; i < n; ++i) ring_[i] = {(i + n - 1) % n, (i + 1) % n};
  grid_.fill(alive_);
}

void EarClipper::run(std::vector<build::Triangle>& triangles) {
  for (std::uint32_t i = 0; i < ring_.size() && !interrupted_at(i); ++i) examine(i);
  while (left_ > 3 && !interrupted_at(left_)) clip(next_ear(), triangles);
  while (!alive_[first_]) ++first_;
  const std::uint32_t a = first_, b = ring_[a].after, c = ring_[b].after;
  triangles.push_back({corners_[a], corners_[b], corners_[c]});
}

/// Is a corner an ear now? If not because of a corner in its triangle, it waits for that one.
void EarClipper::examine(std::uint32_t at) {
  Corner& corner = ring_[at];
  corner.is_ear = false;
  corner.blocker = kNone;
  const PlanePoint &a = points_[corner.before], &b = points_[at], &c = points_[corner.after];
  if (area2(a, b, c) <= 0) return;
  corner.blocker = grid_.find(a, b, c, [&](std::uint32_t i) {
    const PlanePoint& p = points_[i];
    if (!alive_[i] || p == a || p == b || p == c) return false;
    return area2(a, b, p) >= 0 && area2(b, c, p) >= 0 && area2(c, a, p) >= 0;
  });
  if (corner.blocker != kNone) return waiting_[corner.blocker].push_back(at);
  corner.is_ear = true;
  ears_.push(at);
}

/// A polygon that crosses itself may have no ear; any corner will do then.
std::uint32_t EarClipper::next_ear() {
  while (!ears_.empty()) {
    const std::uint32_t ear = ears_.top();
    if (alive_[ear] && ring_[ear].is_ear) return ear;
    ears_.pop();
  }
  while (!alive_[first_]) ++first_;
  return first_;
}

void EarClipper::clip(std::uint32_t at, std::vector<build::Triangle>& triangles) {
  const Corner corner = ring_[at];
  triangles.push_back({corners_[corner.before], corners_[at], corners_[corner.after]});
  alive_[at] = false;
  ring_[corner.before].after = corner.after;
  ring_[corner.after].before = corner.before;
  if (--left_ < in_grid_ / 2) {
    grid_.fill(alive_);
    in_grid_ = left_;
  }
  examine(corner.before);
  examine(corner.after);
  for (const std::uint32_t waiting : std::exchange(waiting_[at], {}))
    if (alive_[waiting] && ring_[waiting].blocker == at) examine(waiting);
}

}  // namespace hiprt::tools
