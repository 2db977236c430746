#pragma once
/// The textbook sphere test in float. The measurements must find its errors; its time is the reference.

#include <hiprt_device/math/vec_functions.h>
#include <tests/primitives/shapes.h>

namespace hiprt::checks {

/// t from the roots of a t^2 + 2 b t + c by (-b -+ sqrt(b^2 - a c)) / a; no bound of its errors.
struct NaiveSphere {
  template <class Report> bool operator()(const Case& shape, const Ray& ray, Report&& report) const {
    const Vec3 center(shape.a.position[0], shape.a.position[1], shape.a.position[2]);
    const Vec3 from = ray.origin - center;
    const float a = glm::dot(ray.direction, ray.direction), b = glm::dot(from, ray.direction),
                c = glm::dot(from, from) - shape.a.radius * shape.a.radius;
    const float discriminant = b * b - a * c;
    if (!(discriminant >= 0.0f)) return true;
    const float root = std::sqrt(discriminant);
    for (const float t : {(-b - root) / a, (-b + root) / a}) {
      if (!(t >= ray.tmin && t <= ray.tmax)) continue;
      const Vec3 normal = (from + t * ray.direction) / shape.a.radius;
      if (!report(CustomHit{t, 0.0f, 0.0f, normal, 0.0f})) return false;
    }
    return true;
  }
};

}  // namespace hiprt::checks
