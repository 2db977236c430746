#pragma once
/// Rays for scenes of unknown origin: into the bounds, along the axes, and with wild numbers.

#include "random.h"

#include <hiprt_device/ray.h>

#include <limits>

namespace hiprt::fuzz {

class RaySource {
 public:
  RaySource(const Box& bounds, std::uint64_t seed) : bounds_(bounds), random_(seed) {}

  Ray next() {
    Ray ray;
    ray.origin = point();
    ray.direction = point() - ray.origin;
    const std::uint64_t kind = random_.below(8);
    if (kind == 0) ray.direction = Vec3(random_.wild(), random_.wild(), random_.wild());
    if (kind == 1) ray.origin = Vec3(random_.wild(), random_.wild(), random_.wild());
    if (kind == 2) ray.direction[axis()] = random_.below(2) == 0 ? 0.0f : -0.0f;
    if (kind == 3) {
      ray.direction = Vec3(0.0f);
      ray.direction[axis()] = random_.uniform_float(-0.5, 0.5);
    }
    if (kind == 4) ray.origin -= 3.0f * ray.direction;
    if (random_.below(8) == 0) ray.tmin = random_.wild();
    if (random_.below(8) == 0) ray.tmax = random_.wild();
    ray.time = random_.below(4) == 0 ? random_.wild() : random_.uniform_float(-0.5, 1.5);
    if (random_.below(8) == 0) ray.mask = static_cast<std::uint32_t>(random_.bits());
    return ray;
  }

 private:
  int axis() { return static_cast<int>(random_.below(3)); }

  /// In the bounds, often on one of their planes.
  Vec3 point() {
    Vec3 result(0.0f);
    for (int k = 0; k < 3; ++k) {
      const float at = random_.below(4) == 0 ? static_cast<float>(random_.below(2)) : random_.uniform_float(0, 1);
      result[k] = bounds_.min[k] * (1.0f - at) + bounds_.max[k] * at;
    }
    return result;
  }

  Box bounds_;
  Random random_;
};

}  // namespace hiprt::fuzz
