#pragma once
// Custom primitives: balls, hit where a ray enters them and where it leaves them.

#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/math/vec_functions.h>

struct Round {
  hiprt::Vec3 centre;
  float radius;
};

struct Balls {
  const Round* balls;

  template <class Report>
  HIPRT_HD bool intersect(const hiprt::Ray& ray, float, float, unsigned i, Report&& report) const {
    const hiprt::Vec3 from = ray.origin - balls[i].centre;
    const float a = glm::dot(ray.direction, ray.direction), b = glm::dot(from, ray.direction);
    const float square = b * b - a * (glm::dot(from, from) - balls[i].radius * balls[i].radius);
    if (!(square >= 0)) return true;
    const auto at = [&](float t) {
      return hiprt::CustomHit{t, 0, 0, from + t * ray.direction, 1e-6f * (glm::length(from) + balls[i].radius)};
    };
    return report(at((-b - sqrtf(square)) / a)) && report(at((-b + sqrtf(square)) / a));
  }
};
