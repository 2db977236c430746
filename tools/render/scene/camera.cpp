#include <tools/render/scene/camera.h>

#include <tools/base/text.h>

#include <hiprt_device/math/vec_functions.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

namespace hiprt::tools {
namespace {

double radians(double degrees) { return degrees * (std::numbers::pi / 180.0); }

/// Orthonormal axes of a view along @p forward.
struct Basis {
  Vec3d right, up, forward;
};

Basis basis_of(const Vec3d& direction, const Vec3d& up) {
  const Vec3d forward = unit(direction);
  const Vec3d right = unit(glm::cross(forward, unit(up)));
  return {right, glm::cross(right, forward), forward};
}

}  // namespace

Vec3d unit(const Vec3d& v) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  return largest > 0.0 ? glm::normalize(v / largest) : v;
}

// ---- Rays ----------------------------------------------------------------------------------------------------------

CameraRays::CameraRays(const Camera& camera, std::uint32_t width, std::uint32_t height)
    // Rays start at the eye rounded to float; their directions are computed from there.
    : eye_(Vec3(camera.eye)),
      half_width_(0.5 * width),
      half_height_(0.5 * height),
      pixels_per_tangent_(half_height_ / std::tan(0.5 * radians(camera.fov_degrees))) {
  const Basis basis = basis_of(camera.at - eye_, camera.up);
  forward_ = basis.forward;
  right_ = basis.right;
  up_ = basis.up;
}

CameraRays::Position CameraRays::project(const Vec3d& point) const {
  const Vec3d offset = point - eye_;
  const double depth = glm::dot(offset, forward_);
  const double scale = pixels_per_tangent_ / depth;
  return {half_width_ + glm::dot(offset, right_) * scale, half_height_ - glm::dot(offset, up_) * scale, depth > 0.0};
}

// ---- Automatic camera ----------------------------------------------------------------------------------------------

namespace {

constexpr double kMargin = 1.08;  ///< Picture / object, in tangents.

struct DoubleBox {
  Vec3d min, max;
};

/// @return the box, enlarged if it is so small that the eye, in float, could not be placed at a distance.
DoubleBox usable_box(const Box& bounds) {
  DoubleBox box{{bounds.min[0], bounds.min[1], bounds.min[2]}, {bounds.max[0], bounds.max[1], bounds.max[2]}};
  for (int axis = 0; axis < 3; ++axis)
    if (!(std::isfinite(box.min[axis]) && std::isfinite(box.max[axis]) && box.min[axis] <= box.max[axis]))
      return {Vec3d(-1.0), Vec3d(1.0)};
  const Vec3d extent = box.max - box.min;
  const double size = std::max({extent.x, extent.y, extent.z});
  double coordinate = 0.0;
  for (int axis = 0; axis < 3; ++axis)
    coordinate = std::max({coordinate, std::abs(box.min[axis]), std::abs(box.max[axis])});
  const double smallest = coordinate > 0.0 ? coordinate * (16.0 * std::numeric_limits<float>::epsilon()) : 1.0;
  if (size >= smallest) return box;
  return {box.min - Vec3d(0.5 * smallest), box.max + Vec3d(0.5 * smallest)};
}

/// The direction from the object to the eye, of unit length.
Vec3d view_side(const Vec3d& extent) {
  const double widest = std::max(extent.x, extent.z);
  const bool lies_flat = extent.y < 0.1 * widest;
  const double azimuth = radians(extent.x < extent.z ? 68.0 : 22.0);  // 0: from +z, 90: from +x.
  const double elevation = radians(lies_flat ? 38.0 : 16.0);
  return {std::sin(azimuth) * std::cos(elevation), std::sin(elevation), std::cos(azimuth) * std::cos(elevation)};
}

/// One axis of the picture; t is the tangent of half the angle, e the eye's coordinate. The eye sees a point (x, z) if
/// |x - e| <= t * (z - depth). This holds exactly if x - t z <= e - t depth and -x - t z <= -e - t depth. The struct
/// keeps the maxima of the left sides.
struct Slab {
  double tangent;
  double upper = -std::numeric_limits<double>::infinity();
  double lower = -std::numeric_limits<double>::infinity();

  void add(double x, double z) {
    upper = std::max(upper, x - tangent * z);
    lower = std::max(lower, -x - tangent * z);
  }
  /// The nearest depth of an eye that sees all points; farther back is fine too.
  double depth() const { return -(upper + lower) / (2.0 * tangent); }
  /// The eye's coordinate with equal margins on both sides, at any such depth.
  double centre() const { return 0.5 * (upper - lower); }
};

}  // namespace

Camera automatic_camera(const Box& bounds, double aspect) {
  const DoubleBox box = usable_box(bounds);
  const Vec3d centre = 0.5 * (box.min + box.max);
  Camera camera;
  const Basis basis = basis_of(-view_side(box.max - box.min), camera.up);
  const double tangent = std::min(std::tan(radians(18.0)), std::tan(radians(32.0)) / aspect);
  Slab horizontal{.tangent = tangent * aspect / kMargin};
  Slab vertical{.tangent = tangent / kMargin};
  for (unsigned corner = 0; corner < 8; ++corner) {
    const Vec3d point((corner & 1u) != 0 ? box.max.x : box.min.x, (corner & 2u) != 0 ? box.max.y : box.min.y,
                      (corner & 4u) != 0 ? box.max.z : box.min.z);
    const Vec3d offset = point - centre;
    const double z = glm::dot(offset, basis.forward);
    horizontal.add(glm::dot(offset, basis.right), z);
    vertical.add(glm::dot(offset, basis.up), z);
  }
  const double depth = std::min(horizontal.depth(), vertical.depth());
  camera.at = centre + basis.right * horizontal.centre() + basis.up * vertical.centre();
  camera.eye = camera.at + basis.forward * depth;
  camera.fov_degrees = 2.0 * std::atan(tangent) * (180.0 / std::numbers::pi);
  return camera;
}

// ---- Text ----------------------------------------------------------------------------------------------------------

namespace {

constexpr std::string_view kBlanks = ", \t\r\n";

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::vector<std::string_view> split(std::string_view text, std::string_view separators) {
  std::vector<std::string_view> parts;
  while (true) {
    const auto end = text.find_first_of(separators);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

/// @param wanted how many finite numbers the part must have, after an optional label.
tl::expected<std::vector<double>, std::string> parse_part(std::string_view part, std::string_view label,
                                                          std::size_t wanted) {
  const auto fail = [&](const std::string& what) { return tl::unexpected(std::string(label) + ": " + what); };
  std::vector<double> numbers;
  bool first = true;
  for (const std::string_view word : split(part, kBlanks)) {
    if (word.empty()) continue;
    if (std::exchange(first, false) && word == label) continue;
    double number = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error == std::errc::result_out_of_range) return fail(in_quotes(word) + " is out of range");
    if (error != std::errc() || end != word.data() + word.size()) return fail(in_quotes(word) + " is not a number");
    if (!std::isfinite(number)) return fail(in_quotes(word) + " is not finite");
    numbers.push_back(number);
  }
  if (numbers.size() != wanted)
    return fail("expected " + std::to_string(wanted) + (wanted == 1 ? " number" : " numbers") + ", got " +
                std::to_string(numbers.size()) + " in " + in_quotes(trimmed(part)));
  return numbers;
}

/// The numbers of eye, at, up, fov and light. The last is empty if the text has no light.
tl::expected<std::array<std::vector<double>, 5>, std::string> parse_parts(std::string_view text) {
  struct Part {
    std::string_view label;
    std::size_t numbers;
  };
  constexpr std::array<Part, 5> kParts{{{"eye", 3}, {"at", 3}, {"up", 3}, {"fov", 1}, {"light", 3}}};
  const std::vector<std::string_view> parts = split(text, "/");
  if (parts.size() != 4 && parts.size() != 5)
    return tl::unexpected("expected eye/at/up/fov, four parts separated by '/', got " + std::to_string(parts.size()) +
                          " in " + in_quotes(trimmed(text)));
  std::array<std::vector<double>, 5> values;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    auto numbers = parse_part(parts[i], kParts[i].label, kParts[i].numbers);
    if (!numbers) return tl::unexpected(numbers.error());
    values[i] = std::move(*numbers);
  }
  return values;
}

Vec3d vector_of(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

tl::expected<Camera, std::string> checked(const Camera& camera) {
  if (!(camera.fov_degrees > 0.0 && camera.fov_degrees < 180.0))
    return tl::unexpected(std::string("fov: the vertical angle must lie between 0 and 180 degrees"));
  // Rays start at a float.
  const Vec3d eye(Vec3(camera.eye));
  if (!(std::isfinite(eye.x) && std::isfinite(eye.y) && std::isfinite(eye.z)))
    return tl::unexpected(std::string("eye: beyond the range of float"));
  if (eye == camera.at) return tl::unexpected(std::string("at: the same point as eye"));
  if (camera.up == Vec3d(0.0)) return tl::unexpected(std::string("up: must not be zero"));
  const Vec3d side = glm::cross(unit(camera.at - eye), unit(camera.up));
  if (glm::dot(side, side) < 1e-20) return tl::unexpected(std::string("up: parallel to the direction of view"));
  return camera;
}

tl::expected<Camera, std::string> parse_camera(std::string_view text) {
  const auto values = parse_parts(text);
  if (!values) return tl::unexpected(values.error());
  return checked({vector_of((*values)[0]), vector_of((*values)[1]), vector_of((*values)[2]), (*values)[3][0]});
}

tl::expected<std::optional<Vec3d>, std::string> parse_light(std::string_view text) {
  const auto values = parse_parts(text);
  if (!values) return tl::unexpected(values.error());
  const std::vector<double>& light = (*values)[4];
  return light.empty() ? std::nullopt : std::optional(vector_of(light));
}

std::string to_text(const Camera& camera) {
  std::string text;
  const auto append = [&text](double value, char end) {
    std::array<char, 32> digits;
    const auto result = std::to_chars(digits.data(), digits.data() + digits.size(), value);
    text.append(digits.data(), result.ptr);
    if (end != '\0') text.push_back(end);
  };
  for (const Vec3d& vector : {camera.eye, camera.at, camera.up}) {
    append(vector.x, ',');
    append(vector.y, ',');
    append(vector.z, '/');
  }
  append(camera.fov_degrees, '\0');
  return text;
}

}  // namespace hiprt::tools
