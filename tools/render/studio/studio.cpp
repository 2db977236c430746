#include <tools/render/studio/studio.h>

#include <hiprt_device/math/vec_functions.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hiprt::tools {
namespace {

Vec3 lerp(const Vec3& a, const Vec3& b, float t) { return a + (b - a) * t; }

float smooth_step(float low, float high, float v) {
  const float t = std::clamp((v - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

/// Light of the dome by the cosine to the zenith.
Vec3 dome_light(float height) {
  constexpr Vec3 kFloor{0.11f, 0.10f, 0.09f}, kHorizon{0.24f, 0.27f, 0.31f}, kZenith{0.38f, 0.44f, 0.53f};
  return height < 0.0f ? lerp(kFloor, kHorizon, smooth_step(-0.4f, 0.0f, height))
                       : lerp(kHorizon, kZenith, smooth_step(0.0f, 0.8f, height));
}

/// The key light by the cosine to its middle.
Vec3 key_light(float cosine) {
  constexpr Vec3 kKey{2.55f, 2.36f, 2.06f};
  const float squared = std::max(0.0f, cosine) * std::max(0.0f, cosine);
  return kKey * (squared * squared);
}

}  // namespace

ZonalIrradiance::ZonalIrradiance(const std::function<Vec3(float)>& light) {
  constexpr int kRings = 32, kSectors = 64;
  for (std::size_t i = 0; i <= kSteps; ++i) {
    const float c = 2.0f * static_cast<float>(i) / kSteps - 1.0f;
    const float s = std::sqrt(std::max(0.0f, 1.0f - c * c));
    Vec3 sum(0.0f);
    // Rings of equal weight: the square of the sine is uniform under the cosine's density.
    for (int ring = 0; ring < kRings; ++ring)
      for (int sector = 0; sector < kSectors; ++sector) {
        const float sine = std::sqrt((static_cast<float>(ring) + 0.5f) / kRings);
        const float cosine = std::sqrt(1.0f - sine * sine);
        const float angle = (static_cast<float>(sector) + 0.5f) * (2.0f * std::numbers::pi_v<float> / kSectors);
        sum += light(c * cosine + s * sine * std::cos(angle));
      }
    table_[i] = sum / static_cast<float>(kRings * kSectors);
  }
}

Vec3 ZonalIrradiance::at(float cosine) const {
  const float position = std::clamp(0.5f * cosine + 0.5f, 0.0f, 1.0f) * kSteps;
  const std::size_t i = std::min(static_cast<std::size_t>(position), kSteps - 1);
  return lerp(table_[i], table_[i + 1], position - static_cast<float>(i));
}

Studio::Studio(const Camera& camera) : dome_(dome_light), lobe_(key_light) {
  const Vec3d up = unit(camera.up);
  const Vec3d back = unit(camera.eye - camera.at);
  const Vec3d right = unit(glm::cross(up, back));
  up_ = Vec3(up);
  key_ = Vec3(unit(-0.8 * right + 0.75 * up + 0.3 * back));
}

Vec3 Studio::sky(const Vec3& direction) const {
  return dome_light(glm::dot(direction, up_)) + key_light(glm::dot(direction, key_));
}

Vec3 Studio::open_sky(const Vec3& normal) const {
  return dome_.at(glm::dot(normal, up_)) + lobe_.at(glm::dot(normal, key_));
}

Vec3 Studio::backdrop(float height) {
  constexpr Vec3 kBottom{0.68f, 0.71f, 0.74f}, kTop{0.30f, 0.38f, 0.47f};
  return lerp(kBottom, kTop, smooth_step(0.0f, 1.1f, height));
}

}  // namespace hiprt::tools
