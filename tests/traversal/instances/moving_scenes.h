#pragma once
/// Motions of scenes of instances.

#include <tests/oracle/textbook_motion.h>
#include <tests/traversal/instances/instance_scenes.h>

#include <cmath>
#include <memory>

namespace hiprt::checks {

using namespace textbook;

/// The key of a rotation by an axis and an angle. The other parts of the key keep their defaults.
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
