#pragma once
/// Errors of a picture against a reference.

#include <tools/render/image/color_image.h>

#include <hiprt_build/error.h>

namespace hiprt::tools {

/// mse and relative_mse are errors of linear colours. psnr and flip are errors of the displayed picture: reinhard()
/// (color.h) compresses colours above 1 in both pictures, with the reference's brightest pixel as white.
struct ImageDifference {
  double mse;           ///< Mean over all values (three per pixel) of (p - r)^2.
  double relative_mse;  ///< Mean of (p - r)^2 / (r^2 + 0.01): Rousselle, Knaus, Zwicker, "Adaptive Sampling and
                        ///< Reconstruction using Greedy Error Minimization", 2011, with their 0.01.
  double psnr;          ///< 10 log10(255^2 / mean of squared differences) of 8-bit sRGB values, in dB; +inf: all equal.
  double flip;          ///< Mean of flip_map (flip.h) of the colours that are not rounded to 8 bits; 0 to 1.
  std::uint32_t width, height;
  std::vector<float> flip_map;  ///< Of every pixel, row by row.
};

/// @param name of the picture, for the message.
/// @return kInvalidInput with name, pixel and channel of the first value that is infinite or not a number.
build::Result<void> check_finite(const ColorImage& image, const std::string& name);

/// @param threads 0: as many as the machine has; the result does not depend on it.
/// @return kInvalidInput: different sizes (both are named), or values that are not finite; kCancelled: interrupted().
build::Result<ImageDifference> compare(ColorImage picture, ColorImage reference, unsigned threads = 0);

/// FLIP's map in the colours of viridis(): dark violet is 0, yellow is 1.
Image flip_picture(const ImageDifference& difference);

}  // namespace hiprt::tools
