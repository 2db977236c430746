#pragma once
/// Colours: linear light with the primaries of sRGB, its 8-bit encoding, and the tone mapping between them.

#include <hiprt_device/math/vec.h>

#include <algorithm>
#include <cmath>

namespace hiprt::tools {

/// Relative luminance of linear light (Rec. 709 primaries, which sRGB shares).
inline float luminance(const Vec3& color) { return 0.2126f * color.x + 0.7152f * color.y + 0.0722f * color.z; }

/// The transfer function of IEC 61966-2-1 (sRGB) and its inverse, on [0, 1].
inline float srgb_from_linear(float v) {
  return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f;
}
inline float linear_from_srgb(float v) { return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f); }
inline Vec3 linear_from_srgb(const Vec3& v) {
  return {linear_from_srgb(v.x), linear_from_srgb(v.y), linear_from_srgb(v.z)};
}

/// Reinhard's extended operator on the luminance ("Photographic tone reproduction", 2002, equation 4): @p white is the
/// smallest luminance that becomes 1. With white 1 nothing changes.
inline Vec3 reinhard(const Vec3& color, float white) {
  const float l = luminance(color);
  return color * ((1.0f + l / (white * white)) / (1.0f + l));
}

/// @return 0 to 255, of linear light that is clamped to [0, 1].
inline unsigned char srgb_byte(float linear) {
  const float encoded = srgb_from_linear(std::clamp(linear, 0.0f, 1.0f));
  return static_cast<unsigned char>(std::lround(encoded * 255.0f));
}

}  // namespace hiprt::tools
