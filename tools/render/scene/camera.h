#pragma once
/// A pinhole camera, read from text or fitted to a scene's bounds, and its rays.

#include <hiprt_device/format/node.h>
#include <hiprt_device/math/vec_functions.h>
#include <hiprt_device/ray.h>

#include <tl/expected.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace hiprt::tools {

/// Cameras are computed in double: a small object far from the origin is still framed to the pixel.
using Vec3d = glm::dvec3;

/// @return @p v / |v| without overflow or underflow in between; 0 for 0.
Vec3d unit(const Vec3d& v);

struct Camera {
  Vec3d eye{0.0, 0.0, 4.0};
  Vec3d at{0.0};
  Vec3d up{0.0, 1.0, 0.0};    ///< Any length; not parallel to at - eye.
  double fov_degrees = 36.0;  ///< Vertical, between 0 and 180.
};

/// @return the camera, or an error, e.g. "eye: beyond the range of float".
tl::expected<Camera, std::string> checked(const Camera& camera);

/// Reads the short form of a camera, or the text of a .cam file:
///     ex,ey,ez/ax,ay,az/ux,uy,uz/fov
///     eye ex ey ez / at ax ay az / up ux uy uz / fov [/ light lx ly lz]
/// Numbers are separated by commas or white space. The labels may be left out. A light is checked and ignored (see
/// parse_light()).
/// @return the camera, or an error with the part and the text, e.g. "eye: expected 3 numbers, got 2 in '1,2'".
tl::expected<Camera, std::string> parse_camera(std::string_view text);

/// @return the light of such a text, if it has one, or an error of parse_camera(). The camera as a whole is not
/// checked.
tl::expected<std::optional<Vec3d>, std::string> parse_light(std::string_view text);

/// @return the camera as text for parse_camera(), with every digit.
std::string to_text(const Camera& camera);

/// @return a camera that sees the whole box with a small margin. It looks from slightly above (+y is up) at the box's
/// larger face. It sees flat boxes more from above. The eye is as near as the four sides of the picture permit.
/// @param bounds may be empty, a point, flat, tiny or far away. Bounds that are not finite count as empty.
/// @param aspect width / height of the picture, more than 0. Wide pictures get a smaller vertical angle, so that the
/// horizontal angle stays below 64 degrees.
Camera automatic_camera(const Box& bounds, double aspect);

/// Rays of a camera through a picture of width x height pixels; pixel (0, 0) is at the top left.
class CameraRays {
 public:
  CameraRays(const Camera& camera, std::uint32_t width, std::uint32_t height);

  /// @param x, y position in pixels; the centre of the first pixel is (0.5, 0.5).
  /// @return a ray of unit direction from the eye, tmin 0, tmax infinite.
  HIPRT_HD HIPRT_FORCE_INLINE Ray ray(double x, double y) const {
    const Vec3d direction = forward_ + (right_ * (x - half_width_) + up_ * (half_height_ - y)) / pixels_per_tangent_;
    Ray ray;
    ray.origin = Vec3(eye_);
    ray.direction = Vec3(glm::normalize(direction));
    return ray;
  }

  /// The position of a point in pixels. The camera can see the point only if it is in front of the eye.
  struct Position {
    double x, y;
    bool in_front;
  };
  Position project(const Vec3d& point) const;

 private:
  Vec3d eye_;
  Vec3d forward_, right_, up_;  ///< Orthonormal.
  double half_width_, half_height_, pixels_per_tangent_;
};

}  // namespace hiprt::tools
