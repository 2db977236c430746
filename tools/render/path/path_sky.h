#pragma once
/// The sky of a path tracer, from a function or a picture.

#include <hiprt_device/math/vec.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace hiprt::tools {

/// A picture of all directions and tables to sample it: PathArrays::sky, sky_rows and sky_columns.
struct PathSky {
  std::vector<Vec3> radiance;
  std::vector<float> rows, columns;
};

/// @param light radiance from a unit direction, not negative. Values that are not finite count as black.
/// @param size of the square, in pixels, at least 1.
PathSky make_sky(const std::function<Vec3(const Vec3&)>& light, std::uint32_t size);

/// @param pixels of a picture in equirectangular projection, row by row, the top row (+y) first. From left to right,
/// the angle from +x towards +z goes from -180 to 180 degrees.
PathSky make_sky(std::span<const Vec3> pixels, std::uint32_t width, std::uint32_t height);

}  // namespace hiprt::tools
