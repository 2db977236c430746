#pragma once
/// Paths: the instances that lead from a scene to a primitive. And hits that have a path.

#include <hiprt_device/ray.h>

namespace hiprt {

/// The instances between a scene and a primitive, the outermost first.
///
/// Numbers are indices of InstanceRecord in the file that has the instance (SceneView::instances for the first).
template <unsigned kLevels> struct InstancePath {
  std::uint32_t depth = 0;  ///< Number of instances; 0 in a scene without instances.
  std::uint32_t instance[kLevels] = {};

  /// Orders paths by their numbers. A path comes before the paths that it begins.
  HIPRT_HD friend bool operator<(const InstancePath& a, const InstancePath& b) {
    for (unsigned i = 0; i < kLevels; ++i) {
      if (i >= a.depth || i >= b.depth) return a.depth < b.depth;
      if (a.instance[i] != b.instance[i]) return a.instance[i] < b.instance[i];
    }
    return false;
  }
  HIPRT_HD friend bool operator==(const InstancePath& a, const InstancePath& b) { return !(a < b) && !(b < a); }
};
/// For policies without levels.
template <> struct InstancePath<0> {
  static constexpr std::uint32_t depth = 0;
  HIPRT_HD friend constexpr bool operator<(InstancePath, InstancePath) { return false; }
  HIPRT_HD friend constexpr bool operator==(InstancePath, InstancePath) { return true; }
};

/// Calls each(i) for the first @p depth of kLevels levels, the outermost first.
///
/// With few levels the compiler knows the indices, so that arrays per level can be in registers. AMD's compiler moves
/// other small arrays to shared memory, for 1024 threads per block if it does not know better.
/// @tparam kUnrolled with more levels it is a loop.
template <unsigned kLevels, unsigned kUnrolled = 2, class Each>
HIPRT_HD HIPRT_FORCE_INLINE void for_levels(std::uint32_t depth, Each&& each) {
  if constexpr (kLevels <= kUnrolled) {
    for (unsigned i = 0; i < kLevels; ++i)
      if (i < depth) each(i);
  } else {
    for (unsigned i = 0; i < depth; ++i) each(i);
  }
}

/// The same, the innermost first.
template <unsigned kLevels, unsigned kUnrolled = 2, class Each>
HIPRT_HD HIPRT_FORCE_INLINE void for_levels_backwards(std::uint32_t depth, Each&& each) {
  if constexpr (kLevels <= kUnrolled) {
    for (unsigned i = kLevels; i-- > 0;)
      if (i < depth) each(i);
  } else {
    for (unsigned i = depth; i-- > 0;) each(i);
  }
}

/// The path of the first @p depth of these numbers.
template <unsigned kLevels>
HIPRT_HD HIPRT_FORCE_INLINE InstancePath<kLevels> path_of(std::uint32_t depth, const std::uint32_t* instance) {
  InstancePath<kLevels> path;
  path.depth = depth;
  for_levels<kLevels, 8>(depth, [&](unsigned i) HIPRT_FORCE_INLINE_LAMBDA { path.instance[i] = instance[i]; });
  return path;
}

/// A hit in a scene of instances. Normal and error are the scene's. Geometry and primitive are those of the object at
/// the end of the path. t, u and v are the same in both.
template <class Real, unsigned kLevels> struct BasicPathHit : BasicHit<Real> { InstancePath<kLevels> path{}; };
template <unsigned kLevels> using PathHit = BasicPathHit<float, kLevels>;

/// The result of queries: a bare Hit for policies without levels.
template <class Real, unsigned kLevels>
using HitOf = std::conditional_t<kLevels == 0, BasicHit<Real>, BasicPathHit<Real, kLevels>>;

}  // namespace hiprt
