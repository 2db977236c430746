#pragma once
/// Motions, and where they take a point by the textbook: in long double.

#include <tests/traversal/instance_scenes.h>

#include <array>
#include <cmath>
#include <memory>

namespace hiprt::checks {

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

/// What an axis and an angle give, with the parts of a key that are left out as they are.
inline build::MotionKey turned_key(float time, const oracle::Double3& axis, double angle,
                                   const oracle::Double3& translation = {0, 0, 0}) {
  build::MotionKey key{.time = time};
  for (unsigned i = 0; i < 3; ++i) {
    key.rotation[i] = static_cast<float>(axis[i] * std::sin(0.5 * angle));
    key.translation[i] = static_cast<float>(translation[i]);
  }
  key.rotation[3] = static_cast<float>(std::cos(0.5 * angle));
  return key;
}

/// Any: rotations up to the largest, quaternions of any length, uneven times and scales, shears, mirrors.
inline build::Motion random_motion(oracle::Random& random, MotionKind kind, unsigned keys, double spread) {
  build::Motion motion{.kind = kind};
  const bool mirrored = random.below(4) == 0, sheared = random.below(3) == 0;
  const double base = random.log_uniform(0.5, 2);
  float time = random.uniform_float(-2, 1);
  for (unsigned k = 0; k < keys; ++k) {
    // Linear matrices pass where they cannot be inverted unless they turn a little only.
    const double angle = kind == MotionKind::kMatrix ? random.uniform(-0.4, 0.4) : random.uniform(-6.3, 6.3);
    const oracle::Double3 axis = kind == MotionKind::kMatrix ? oracle::Double3{0, 0.6, 0.8} : random.on_sphere();
    build::MotionKey key =
        turned_key(time, axis, angle,
                   {random.uniform(-spread, spread), random.uniform(-spread, spread), random.uniform(-spread, spread)});
    const auto length = random.uniform_float(0.5, 2);
    for (float& x : key.rotation) x *= length;
    for (unsigned i = 0; i < 3; ++i) {
      key.scale[i] = static_cast<float>(base * random.log_uniform(0.7, 1.4)) * (mirrored && i == 1 ? -1.0f : 1.0f);
      if (sheared) key.shear[i] = random.uniform_float(-0.5, 0.5);
    }
    motion.keys.push_back(key);
    time += static_cast<float>(random.log_uniform(0.05, 2));
  }
  return motion;
}

}  // namespace hiprt::checks
