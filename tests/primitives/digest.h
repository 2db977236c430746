#pragma once
/// Digests of the hits and of the closest points of custom primitives. The cases are made from integers, so every
/// processor must give the same digest.

#include <hiprt_device/primitives/round_curve.h>
#include <hiprt_device/primitives/sphere.h>

#include <bit>

namespace hiprt::checks {

/// Digests of cases 0 to kDigestCases - 1; tests/primitives/digest.hip prints a GPU's digests.
inline constexpr std::uint32_t kDigestCases = 1u << 18;
inline constexpr std::uint64_t kDigest = 0xedb81e0aa1173ebb;
inline constexpr std::uint64_t kPointDigest = 0x86fa81d8f15d023b;

/// SplitMix64 (Steele, Lea, Flood 2014).
struct DigestRandom {
  std::uint64_t state;

  HIPRT_HD std::uint64_t bits() {
    state += 0x9e3779b97f4a7c15u;
    std::uint64_t z = state;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
  }
  /// A multiple of 2^-23 or of 2^-10 in [-1, 1): no rounding.
  HIPRT_HD float unit(bool coarse) {
    const auto fine = static_cast<std::int32_t>(bits() >> 40) - (1 << 23);
    return static_cast<float>(coarse ? fine & ~0x1fff : fine) * 0x1p-23f;
  }
  /// 2^k for a random k in [-range, range].
  HIPRT_HD float power(std::uint32_t range) {
    const std::uint32_t k = static_cast<std::uint32_t>(bits() >> 32) % (2 * range + 1);
    return std::bit_cast<float>((127 - range + k) << 23);
  }
};

/// Two balls, some of radius 0.
HIPRT_HD inline void set_vertices(DigestRandom& random, std::uint32_t index, float size, CurveVertex (&vertex)[2]) {
  const bool coarse = (index & 1u) != 0;
  for (CurveVertex& v : vertex) {
    for (float& p : v.position) p = random.unit(coarse) * size;
    const float radius = random.unit(coarse);
    v.radius = (radius < 0.0f ? -radius : radius) * size * (coarse ? 1.0f : random.power(3));
  }
  if ((index & 56u) == 0) vertex[1].radius = 0.0f;
}

/// Half of the rays start anywhere. The others start on the surface, at a pole or a tip, mostly exactly. Their t is the
/// rounding error of an exact 0: a float shows every bit of such a double.
/// @return a number that depends on every bit of every hit of a sphere and of a curve.
HIPRT_HD inline std::uint64_t digest_case(std::uint32_t index) {
  DigestRandom random{std::uint64_t{index} << 20};
  const bool coarse = (index & 1u) != 0;
  const float size = random.power(20), step = random.power(30);
  CurveVertex vertex[2];
  set_vertices(random, index, size, vertex);
  Ray ray;
  for (int axis = 0; axis < 3; ++axis) {
    const float from = random.unit(coarse) * size * 0x1p3f, to = random.unit(coarse) * size;
    ray.origin[axis] = (index & 2u) == 0 ? from : vertex[(index >> 2) & 1u].position[axis];
    ray.direction[axis] = (to - ray.origin[axis]) * step;
  }
  if ((index & 6u) == 2) ray.origin.x = vertex[0].position[0] + vertex[0].radius;
  if ((index & 0x1f0u) == 0) ray.direction.y = 0.0f;
  std::uint64_t digest = 0;
  const auto add = [&](float value) { digest = DigestRandom{digest ^ std::bit_cast<std::uint32_t>(value)}.bits(); };
  const auto add_hit = [&](const CustomHit& hit) {
    add(hit.t), add(hit.u), add(hit.v), add(hit.error);
    add(hit.normal.x), add(hit.normal.y), add(hit.normal.z);
    return true;
  };
  constexpr float kMax = std::numeric_limits<float>::max();
  const Sphere sphere{{vertex[0].position[0], vertex[0].position[1], vertex[0].position[2]}, vertex[0].radius};
  SphereSet{&sphere}.intersect(ray, -kMax, kMax, 0, add_hit);
  const std::uint32_t first = 0;
  RoundCurveSet{vertex, &first}.intersect(ray, -kMax, kMax, 0, add_hit);
  return digest;
}

/// Points are near, at a center, in the middle of the axis or far.
/// @return a number that depends on every bit of the closest points of a sphere and of a curve.
HIPRT_HD inline std::uint64_t digest_points(std::uint32_t index) {
  DigestRandom random{std::uint64_t{index} << 20};
  const float size = random.power(20);
  CurveVertex vertex[2];
  set_vertices(random, index, size, vertex);
  PointInObject at{Vec3D(0), std::numeric_limits<double>::infinity(), 0.0f};
  const unsigned kind = (index >> 1) & 7u;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = vertex[0].position[axis], b = vertex[1].position[axis];
    const double near = static_cast<double>(random.unit(false)) * static_cast<double>(size);
    at.point[axis] = kind == 0 ? a : kind == 1 ? 0.5 * (a + b) : kind == 2 ? 0x1p40 * near : 2.0 * near;
  }
  std::uint64_t digest = 0;
  const auto add = [&](double value) { digest = DigestRandom{digest ^ std::bit_cast<std::uint64_t>(value)}.bits(); };
  const auto add_point = [&](const CustomPoint& point) {
    add(point.squared), add(point.u), add(point.v);
    add(point.point.x), add(point.point.y), add(point.point.z);
  };
  const Sphere sphere{{vertex[0].position[0], vertex[0].position[1], vertex[0].position[2]}, vertex[0].radius};
  add_point(SphereSet{&sphere}.closest(at, 0));
  const std::uint32_t first = 0;
  add_point(RoundCurveSet{vertex, &first}.closest(at, 0));
  return digest;
}

}  // namespace hiprt::checks
