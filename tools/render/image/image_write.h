#pragma once
/// Writes pictures as OpenEXR and PNG files.

#include <hiprt_build/error.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace hiprt::tools {

struct Image;

/// Names and values that describe the origin of a picture.
using ImageAttributes = std::vector<std::pair<std::string, std::string>>;

/// Called every few rows with the finished fraction. If it returns false, nothing is written and the error is
/// kCancelled.
using EncodeProgress = std::function<bool(double)>;

/// OpenEXR, ZIP compressed, 32 bits per value. Values that are not finite are kept.
///     R G B                         float  colour
///     N.X N.Y N.Z  P.X P.Y P.Z  Z   float  normal, position, depth
///     id.geometry id.primitive      uint   0xffffffff for a miss
///     cost.boxes cost.leaves        uint   four-box tests and leaf tests of the ray
///     cost.triangles                uint   triangles in these leaves (one or two per leaf)
///     cost.steps                    uint   steps of the traversal: both kinds of tests, and instances
///     cost.fill                     float  used fraction of the leaves' capacity, two triangles per leaf; 0: no leaf
///     id.instance cost.instances    uint   only for a scene of instances
/// With Image::shading also these, under the names of pbrt-v4's GBuffer film:
///     Albedo.R Albedo.G Albedo.B  Ns.X Ns.Y Ns.Z  u v                                                      float
///     Variance.R Variance.G Variance.B  RelativeVariance.R RelativeVariance.G RelativeVariance.B           float
/// Writes the whole file or none.
/// @return the bytes written, or kIo with path and reason.
build::Result<std::size_t> write_exr(const std::filesystem::path& path, const Image& image,
                                     const ImageAttributes& attributes, const EncodeProgress& progress = {});

/// PNG, 8 bits per channel, sRGB. If a colour is above 1, reinhard() (color.h) compresses the picture, with the
/// brightest pixel as white.
/// Writes the whole file or none.
/// @return the bytes written, or kIo with path and reason.
build::Result<std::size_t> write_png(const std::filesystem::path& path, const Image& image,
                                     const EncodeProgress& progress = {});

}  // namespace hiprt::tools
