#pragma once
/// The picture that bvhrender makes, and the files it becomes.

#include <hiprt_build/error.h>
#include <hiprt_device/format/node.h>
#include <hiprt_device/math/vec.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <utility>
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
  std::uint32_t instance = kInvalidId;  ///< The scene's own (index), the outermost of those on the way to the hit.
  std::uint32_t instance_tests = 0;     ///< Instances that the ray came to, on all levels.
  std::uint32_t steps = 0;              ///< Of the traversal: both kinds of tests, and instances.
  float leaf_fill = 0.0f;               ///< Triangles that the tested leaves had, of two each.
};

/// What a path tracer knows of a pixel beyond that. All but the variances belongs to the ray through its centre.
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
  std::vector<Pixel> pixels;          ///< Row by row, the top row first.
  std::vector<ShadingPixel> shading;  ///< The same of a path tracer; else empty.
};

/// Name and value of what a file says about its origin.
using ImageAttributes = std::vector<std::pair<std::string, std::string>>;

/// Called with 0 to 1 every few rows; false stops, then nothing is written and the error is kCancelled.
using EncodeProgress = std::function<bool(double)>;

/// OpenEXR, ZIP compressed, 32 bits per value; not finite values are kept.
///   R G B                          float   colour
///   N.X N.Y N.Z   P.X P.Y P.Z   Z  float   normal, position, depth
///   id.geometry id.primitive       uint    0xffffffff for a miss
///   cost.boxes cost.leaves         uint    four-box tests and leaf tests of the ray
///   cost.triangles                 uint    triangles (one or two per leaf) in those
///   cost.steps                     uint    of the traversal: both kinds of tests, and instances
///   cost.fill                      float   part of the places for triangles that was used: two per leaf; 0: no leaf
///   id.instance cost.instances     uint    only of a scene of instances
///   Albedo.R Albedo.G Albedo.B   Ns.X Ns.Y Ns.Z   u v   Variance.R Variance.G Variance.B   RelativeVariance.R
///   RelativeVariance.G RelativeVariance.B           float   only with Image::shading, under the names of pbrt-v4's
///                                                           GBuffer film
/// The file appears whole or not at all.
/// @return the bytes written, or kIo with path and reason.
build::Result<std::size_t> write_exr(const std::filesystem::path& path, const Image& image,
                                     const ImageAttributes& attributes, const EncodeProgress& progress = {});

/// PNG, 8 bits per channel, sRGB. Colours brighter than 1 are brought into range by reinhard() (color.h) with the
/// brightest pixel as white; darker pictures are encoded as they are.
/// The file appears whole or not at all.
/// @return the bytes written, or kIo with path and reason.
build::Result<std::size_t> write_png(const std::filesystem::path& path, const Image& image,
                                     const EncodeProgress& progress = {});

}  // namespace hiprt::tools
