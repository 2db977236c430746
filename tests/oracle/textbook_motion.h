#pragma once
/// Motions by textbook formulas in long double.

#include <hiprt_build/motion.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace hiprt::textbook {

using Real = long double;
using Real3 = std::array<Real, 3>;
using Real4 = std::array<Real, 4>;

inline Real dot(const Real4& a, const Real4& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]; }
inline Real4 unit(Real4 q) {
  const Real length = std::sqrt(dot(q, q));
  for (Real& x : q) x /= length;
  return q;
}

/// Slerp (Shoemake 1985) or nlerp of unit quaternions, along the shorter arc.
inline Real4 rotation_between(const Real4& a, Real4 b, Real s, MotionKind kind) {
  if (dot(a, b) < 0)
    for (Real& x : b) x = -x;
  Real4 q;
  if (kind == MotionKind::kNlerp) {
    for (unsigned i = 0; i < 4; ++i) q[i] = (1 - s) * a[i] + s * b[i];
    return unit(q);
  }
  Real4 difference;
  for (unsigned i = 0; i < 4; ++i) difference[i] = b[i] - a[i];
  const Real half = 2 * std::asin(std::min(Real{1}, std::sqrt(dot(difference, difference)) / 2));
  if (half < 1e-15L) return a;
  for (unsigned i = 0; i < 4; ++i)
    q[i] = (std::sin((1 - s) * half) * a[i] + std::sin(s * half) * b[i]) / std::sin(half);
  return q;
}

/// v turned by a unit quaternion.
inline Real3 turned(const Real4& q, const Real3& v) {
  const auto cross = [](const Real3& a, const Real3& b) {
    return Real3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const Real3 axis{q[0], q[1], q[2]}, once = cross(axis, v), twice = cross(axis, once);
  Real3 result;
  for (unsigned i = 0; i < 3; ++i) result[i] = v[i] + 2 * (q[3] * once[i] + twice[i]);
  return result;
}

/// Where the point p of the object is at a time.
inline Real3 moved(const build::Motion& motion, Real time, const Real3& p) {
  const auto& keys = motion.keys;
  std::size_t k = 0;
  while (k + 2 < keys.size() && Real{keys[k + 1].time} <= time) ++k;
  const build::MotionKey &a = keys[k], &b = keys[std::min(k + 1, keys.size() - 1)];
  const Real s = std::clamp((time - Real{a.time}) / (Real{b.time} - Real{a.time}), Real{0}, Real{1});
  const auto between = [&](float from, float to) { return (1 - s) * Real{from} + s * Real{to}; };
  if (motion.kind == MotionKind::kMatrix) {
    const auto from = build::compose(a).to_scene, to = build::compose(b).to_scene;
    Real3 result;
    for (unsigned r = 0; r < 3; ++r) {
      result[r] = between(from.row[r][3], to.row[r][3]);
      for (unsigned c = 0; c < 3; ++c) result[r] += between(from.row[r][c], to.row[r][c]) * p[c];
    }
    return result;
  }
  const auto scale = [&](unsigned i) { return between(a.scale[i], b.scale[i]); };
  const auto shear = [&](unsigned i) { return between(a.shear[i], b.shear[i]); };
  const Real3 stretched{scale(0) * p[0] + shear(0) * p[1] + shear(1) * p[2], scale(1) * p[1] + shear(2) * p[2],
                        scale(2) * p[2]};
  const auto quaternion = [](const build::MotionKey& key) {
    return unit({Real{key.rotation[0]}, Real{key.rotation[1]}, Real{key.rotation[2]}, Real{key.rotation[3]}});
  };
  // Along a chain of keys the sign of a quaternion does not matter.
  Real3 result = turned(rotation_between(quaternion(a), quaternion(b), s, motion.kind), stretched);
  for (unsigned i = 0; i < 3; ++i) result[i] += between(a.translation[i], b.translation[i]);
  return result;
}

}  // namespace hiprt::textbook
