#pragma once
/// The picture that bvhrender renders.

#include <hiprt_device/format/node.h>
#include <hiprt_device/math/vec.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace hiprt::tools {

/// The largest pictures that are made and read.
inline constexpr std::uint32_t kMaxSide = 32768;
inline constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 27;

/// Colour is the mean of the pixel's samples; the rest belongs to the one ray through the pixel's centre.
struct Pixel {
  Vec3 color{0.0f};                                      ///< Linear light, sRGB primaries.
  Vec3 normal{0.0f};                                     ///< Unit, geometric, facing the camera; 0 for a miss.
  Vec3 position{0.0f};                                   ///< In scene units; 0 for a miss.
  float depth = std::numeric_limits<float>::infinity();  ///< Distance from the eye along the ray; +inf for a miss.
  std::uint32_t geometry = kInvalidId;
  std::uint32_t primitive = kInvalidId;  ///< Within the geometry.
  std::uint32_t box_tests = 0;           ///< Four-box tests.
  std::uint32_t leaf_tests = 0;          ///< Tests of a leaf: one or two triangles.
  std::uint32_t triangle_tests = 0;
  std::uint32_t instance = kInvalidId;  ///< Index of the outermost instance of the hit's path.
  std::uint32_t instance_tests = 0;     ///< Instances that the ray came to, on all levels.
  std::uint32_t steps = 0;              ///< Of the traversal: both kinds of tests, and instances.
  float leaf_fill = 0.0f;               ///< Triangles that the tested leaves had, of two each.
};

/// More layers of a path tracer. All except the variances belong to the ray through the pixel's centre.
struct ShadingPixel {
  Vec3 albedo{0.0f};             ///< Base colour; 0 for a miss.
  Vec3 normal{0.0f};             ///< Unit, for shading, facing the camera; 0 for a miss.
  float u = 0.0f, v = 0.0f;      ///< Texture coordinates.
  Vec3 variance{0.0f};           ///< Of the samples, per channel.
  Vec3 relative_variance{0.0f};  ///< That over the squared mean.
};

struct Image {
  Image(std::uint32_t image_width, std::uint32_t image_height)
      : width(image_width), height(image_height), pixels(std::size_t{image_width} * image_height) {}

  Pixel& at(std::uint32_t x, std::uint32_t y) { return pixels[std::size_t{y} * width + x]; }
  const Pixel& at(std::uint32_t x, std::uint32_t y) const { return pixels[std::size_t{y} * width + x]; }

  std::uint32_t width, height;
  bool has_instances = false;         ///< Of a scene of instances.
  bool has_costs = true;              ///< Whether the tests of the centre's ray were counted.
  std::vector<Pixel> pixels;          ///< Row by row, the top row first.
  std::vector<ShadingPixel> shading;  ///< The same of a path tracer; else empty.
};

}  // namespace hiprt::tools
