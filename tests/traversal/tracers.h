#pragma once
/// The traversal under each set of policies, as values for loops. One source compiles them all.

#include <hiprt_device/ray.h>
#include <tests/traversal/scenes.h>

#include <bit>
#include <span>
#include <string>

namespace hiprt::checks {

struct Tracer {
  const char* name;
  bool guaranteed;  ///< Conservative, and Watertight or Reference.
  Hit (*closest)(const Scene& scene, const Ray& ray);
  Hit (*any)(const Scene& scene, const Ray& ray);
  float weight_error = 0.0f;  ///< How far u and v may be outside [0, 1].
};

/// Every combination of Watertight or Fast, box test and lanes, and Reference.
std::span<const Tracer> all_tracers();
/// The default policies with each lanes policy: their hits are the same bits.
std::span<const Tracer> default_tracers();
inline const Tracer& default_tracer() { return default_tracers()[0]; }

/// Entries of the traversal's stack.
std::uint32_t stack_capacity();

inline bool same_bits(float a, float b) { return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b); }

/// Equal bit for bit.
inline bool same_hit(const Hit& a, const Hit& b) {
  return a.geometry == b.geometry && a.primitive == b.primitive && same_bits(a.t, b.t) && same_bits(a.u, b.u) &&
         same_bits(a.v, b.v) && same_bits(a.error, b.error) && same_bits(a.normal.x, b.normal.x) &&
         same_bits(a.normal.y, b.normal.y) && same_bits(a.normal.z, b.normal.z);
}

/// @return the first scene and guaranteed tracer that give another closest hit, or "".
inline std::string find_difference(std::span<const Scene> scenes, const Ray& ray, const Hit& hit) {
  for (const Scene& scene : scenes)
    for (const Tracer& tracer : default_tracers()) {
      const Hit other = tracer.closest(scene, ray);
      if (same_hit(other, hit)) continue;
      return scene.name + ", " + tracer.name + ": t=" + std::to_string(other.t) + " u=" + std::to_string(other.u) +
             " v=" + std::to_string(other.v) + " geometry=" + std::to_string(other.geometry) +
             " primitive=" + std::to_string(other.primitive);
    }
  return "";
}

}  // namespace hiprt::checks
