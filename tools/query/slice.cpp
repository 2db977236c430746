#include <tools/query/slice.h>

#include <tools/base/text.h>
#include <tools/render/image/color.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hiprt::tools {
namespace {

/// The part of the picture's narrower side that is free on each side of the scene.
constexpr double kMargin = 0.1;
/// About so many lines are between the surface and the farthest pixel.
constexpr double kLines = 10.0;

/// The largest of 1, 2 and 5 times a power of ten that is not above @p value.
float round_number(double value) {
  if (!(value > 0.0) || !std::isfinite(value)) return 0.0f;
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  return static_cast<float>(value >= 5.0 * power ? 5.0 * power : value >= 2.0 * power ? 2.0 * power : power);
}

/// An interval of the scene; of an empty scene [0, 0].
struct Extent {
  double low, high;

  Extent(const Box& bounds, unsigned axis) : low(bounds.min[axis]), high(bounds.max[axis]) {
    if (!(low <= high) || !std::isfinite(low) || !std::isfinite(high)) low = high = 0.0;
  }
  double size() const { return high - low; }
  double middle() const { return 0.5 * (low + high); }
};

Vec3 mixed(const Vec3& a, const Vec3& b, float t) { return a * (1.0f - t) + b * t; }

/// How much of a pixel a line covers. @param pixels from the pixel's centre to the line's.
float coverage(double pixels, double half_width) {
  return static_cast<float>(std::clamp(half_width + 0.5 - pixels, 0.0, 1.0));
}

Vec3 color_of(float distance, const SliceScale& scale, double step) {
  if (!std::isfinite(distance)) return linear_from_srgb(Vec3(0.5f, 0.5f, 0.5f));
  const double size = std::abs(static_cast<double>(distance));
  const double most = std::max(std::abs(scale.nearest), std::abs(scale.farthest));
  const auto t = static_cast<float>(most > 0.0 ? size / most : 0.0);
  const Vec3 color = std::signbit(distance) ? mixed({0.62f, 0.80f, 0.95f}, {0.05f, 0.20f, 0.45f}, t)
                                            : mixed({0.98f, 0.84f, 0.62f}, {0.55f, 0.20f, 0.04f}, t);
  float line = 0.0f;
  if (scale.contours > 0.0f) {
    const double lines = size / static_cast<double>(scale.contours), number = std::round(lines);
    const double off = std::abs(lines - number) * static_cast<double>(scale.contours) / step;
    if (number > 0.0) line = 0.6f * coverage(off, 0.5);
  }
  const Vec3 lined = mixed(color, {0.1f, 0.08f, 0.06f}, line);
  return linear_from_srgb(mixed(lined, {1.0f, 1.0f, 1.0f}, coverage(size / step, 1.0)));
}

}  // namespace

std::optional<SlicePlane> parse_plane(std::string_view text) {
  SlicePlane plane;
  if (text.empty() || text[0] < 'x' || text[0] > 'z') return std::nullopt;
  plane.axis = static_cast<unsigned>(text[0] - 'x');
  if (text.size() == 1) return plane;
  const auto position = parse_real<float>(text.substr(2));
  if (text[1] != '=' || !position || !std::isfinite(*position)) return std::nullopt;
  plane.position = *position;
  return plane;
}

std::string check_plane(const std::string& text) {
  if (parse_plane(text)) return {};
  return in_quotes(text) + " is not an axis, x, y or z, or an axis and a position, such as z=0.5";
}

SliceGrid::SliceGrid(const Box& bounds, const SlicePlane& plane, const PictureSize& size)
    : size_(size), axis_(plane.axis) {
  const Extent across(bounds, axis_), wide(bounds, right()), high(bounds, up());
  position_ = plane.position ? static_cast<double>(*plane.position) : across.middle();
  step_ = std::max(wide.size() / size.width, high.size() / size.height) * (1.0 + 2.0 * kMargin);
  if (!(step_ > 0.0)) step_ = 1.0 / std::min(size.width, size.height);
  left_ = wide.middle() - 0.5 * step_ * (size.width - 1.0);
  top_ = high.middle() + 0.5 * step_ * (size.height - 1.0);
}

Vec3 SliceGrid::at(std::uint32_t x, std::uint32_t y) const {
  Vec3 point(static_cast<float>(position_));
  point[static_cast<int>(right())] = static_cast<float>(left_ + step_ * x);
  point[static_cast<int>(up())] = static_cast<float>(top_ - step_ * y);
  return point;
}

QueryBatch SliceGrid::points() const {
  QueryBatch batch{QueryShape::kPoint, {}};
  batch.values.reserve(std::size_t{3} * size_.width * size_.height);
  for (std::uint32_t y = 0; y < size_.height; ++y)
    for (std::uint32_t x = 0; x < size_.width; ++x) {
      const Vec3 point = at(x, y);
      batch.values.insert(batch.values.end(), {point.x, point.y, point.z});
    }
  return batch;
}

SliceScale scale_of(std::span<const PointRecord> records) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  SliceScale scale{kInf, -kInf, 0.0f};
  for (const PointRecord& record : records) {
    if (!std::isfinite(record.distance)) continue;
    scale.nearest = std::min(scale.nearest, record.distance);
    scale.farthest = std::max(scale.farthest, record.distance);
  }
  if (scale.nearest > scale.farthest) return {};
  const double most = std::max(std::abs(scale.nearest), std::abs(scale.farthest));
  scale.contours = round_number(most / kLines);
  return scale;
}

Image draw_slice(const SliceGrid& grid, std::span<const PointRecord> records, const SliceScale& scale) {
  Image image(grid.size().width, grid.size().height);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const PointRecord& record = records[i];
    Pixel& pixel = image.pixels[i];
    pixel.color = color_of(record.distance, scale, grid.step());
    pixel.position = {record.x, record.y, record.z};
    pixel.depth = record.distance;
    pixel.primitive = record.primitive;
  }
  return image;
}

}  // namespace hiprt::tools
