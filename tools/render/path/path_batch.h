#pragma once
/// Which paths are traced together, and what they add to the picture.

#include <hiprt_device/math/vec.h>

#include <cstdint>

namespace hiprt::tools {

/// The pixels and samples of a wave.
struct PathBatch {
  std::uint32_t left, top, width, height;
  std::uint32_t first_sample, samples;

  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t pixels() const { return width * height; }
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t paths() const { return pixels() * samples; }
};

/// Sums over the samples of a pixel.
struct PathSum {
  Vec3 sum{0.0f}, squares{0.0f};
  std::uint32_t samples = 0;
  std::uint32_t lost = 0;  ///< Samples whose value is not finite. They count as black.
};

/// The sums of a rectangle of pixels, row by row.
struct PathSums {
  PathSum* data;
  std::uint32_t left, top;  ///< The rectangle's first pixel in the picture.
  std::uint32_t width;      ///< Of the rectangle.

  HIPRT_HD HIPRT_FORCE_INLINE PathSum& at(std::uint32_t x, std::uint32_t y) const {
    return data[std::uint64_t{y - top} * width + (x - left)];
  }
};

/// Numbers of traced rays.
struct PathRayCounts {
  std::uint64_t camera = 0, secondary = 0, shadow = 0;
  std::uint64_t failed = 0;  ///< Hit::failed(): the stack overflowed, or the tracer does not cover the scene.

  PathRayCounts& operator+=(const PathRayCounts& other) {
    camera += other.camera;
    secondary += other.secondary;
    shadow += other.shadow;
    failed += other.failed;
    return *this;
  }
};

}  // namespace hiprt::tools
