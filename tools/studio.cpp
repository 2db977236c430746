#include "studio.h"

#include <algorithm>

namespace hiprt::tools {
namespace {

Vec3 lerp(const Vec3& a, const Vec3& b, float t) { return a + (b - a) * t; }

float smooth_step(float low, float high, float v) {
  const float t = std::clamp((v - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

}  // namespace

Studio::Studio(const Camera& camera) {
  const Vec3d up = unit(camera.up);
  const Vec3d back = unit(camera.eye - camera.at);
  const Vec3d right = unit(glm::cross(up, back));
  up_ = Vec3(up);
  key_ = Vec3(glm::normalize(-0.8 * right + 0.75 * up + 0.3 * back));
}

Vec3 Studio::sky(const Vec3& direction) const {
  constexpr Vec3 kFloor{0.11f, 0.10f, 0.09f}, kHorizon{0.24f, 0.27f, 0.31f}, kZenith{0.38f, 0.44f, 0.53f};
  constexpr Vec3 kKey{2.55f, 2.36f, 2.06f};
  const float height = glm::dot(direction, up_);
  const Vec3 dome = height < 0.0f ? lerp(kFloor, kHorizon, smooth_step(-0.4f, 0.0f, height))
                                  : lerp(kHorizon, kZenith, smooth_step(0.0f, 0.8f, height));
  const float lobe = std::max(0.0f, glm::dot(direction, key_));
  const float squared = lobe * lobe;
  return dome + kKey * (squared * squared);
}

Vec3 Studio::backdrop(float height) {
  constexpr Vec3 kBottom{0.68f, 0.71f, 0.74f}, kTop{0.30f, 0.38f, 0.47f};
  return lerp(kBottom, kTop, smooth_step(0.0f, 1.1f, height));
}

}  // namespace hiprt::tools
