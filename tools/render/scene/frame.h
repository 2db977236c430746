#pragma once
/// Directions around a normal, and circles: without a mathematics library, so that every machine gives the same bits.

#include <hiprt_device/math/arithmetic.h>
#include <hiprt_device/math/vec.h>
#include <hiprt_device/math/vec_functions.h>

#include <cmath>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

inline constexpr float kPi = 3.14159265358979323846f;

struct SinCos {
  float sine, cosine;
};

/// Of 2 pi * @p turn, 0 to 1. Taylor's series over an eighth of a turn: off by 4e-8 at most, and by rounding.
HIPRT_HD inline SinCos sin_cos_of_turn(float turn) {
  // The nearest one.
  const unsigned quarter = static_cast<unsigned>(8.0f * turn + 1.0f) / 2;
  const float a = 2.0f * kPi * (turn - 0.25f * static_cast<float>(quarter)), aa = a * a;
  const float s = a + a * aa * (-1.0f / 6.0f + aa * (1.0f / 120.0f + aa * (-1.0f / 5040.0f + aa * (1.0f / 362880.0f))));
  const float c = 1.0f + aa * (-0.5f + aa * (1.0f / 24.0f + aa * (-1.0f / 720.0f + aa * (1.0f / 40320.0f))));
  switch (quarter % 4) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

/// Two unit vectors at right angles to a unit normal and to each other (Duff et al., "Building an orthonormal basis,
/// revisited", JCGT 2017).
struct Frame {
  Vec3 tangent, bitangent, normal;

  HIPRT_HD explicit Frame(const Vec3& n) : normal(n) {
    const float sign = n.z < 0.0f ? -1.0f : 1.0f;
    const float a = 1.0f / (sign + n.z), b = n.x * n.y * a;
    tangent = Vec3(1.0f - sign * n.x * n.x * a, -sign * b, -sign * n.x);
    bitangent = Vec3(-b, sign - n.y * n.y * a, -n.y);
  }

  HIPRT_HD Vec3 to_world(const Vec3& v) const { return tangent * v.x + bitangent * v.y + normal * v.z; }
  HIPRT_HD Vec3 to_local(const Vec3& v) const {
    return Vec3(glm::dot(tangent, v), glm::dot(bitangent, v), glm::dot(normal, v));
  }
};

/// A direction of the upper half space with a density of z / pi, from a point of [0, 1)^2.
HIPRT_HD inline Vec3 cosine_direction(float u, float v) {
  const float radius = std::sqrt(u);
  const SinCos angle = sin_cos_of_turn(v);
  return Vec3(radius * angle.cosine, radius * angle.sine, std::sqrt(u < 1.0f ? 1.0f - u : 0.0f));
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
