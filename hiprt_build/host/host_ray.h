#pragma once
/// A ray prepared for HostNodes and for the leaves below them. Internal; for sources compiled with AVX2 and FMA.

#include <hiprt_build/host/host_node.h>
#include <hiprt_build/host/wide_lanes.h>
#include <hiprt_device/host_scene.h>
#include <hiprt_device/intersect/box_test.h>
#include <hiprt_device/ray.h>

namespace hiprt::format_detail {
inline namespace HIPRT_ISA_NAMESPACE {

/// A ray for the boxes of nodes. The distance to a plane p of axis k is p * rcp[k] + offset[k].
struct HostSlabs {
  WideLanes::Float rcp[3], near_offset[3], far_offset[3];
  WideLanes::Float begin, end;  ///< The part of the ray that is left: finite, at least +0.
  std::size_t near_planes[3];   ///< Bytes from a node to the planes that the ray meets first, per axis.
};

/// A leaf's vertices are sheared so that the ray is the z axis (intersect/sheared_space.h).
struct HostRay {
  HostSlabs slabs;
  float tmin, limit;          ///< The part of the ray that is left; both finite, tmin at least +0.
  float origin[4], shear[4];  ///< In the axes x, y, z of the sheared space; the fourth number is not used.
  std::size_t row[3];         ///< Bytes from a leaf to its coordinates of these axes.
  float dz;                   ///< The direction's largest component.
  float least_depth, slack;   ///< For LeafEdges::triangles_met().

  HIPRT_FORCE_INLINE void set_limit(float t) {
    limit = t;
    slabs.end = WideLanes::all(max_of(t, 0.0f));
  }
};

/// The planes of the same axis that the ray meets last.
constexpr std::size_t far_planes(std::size_t near_planes) { return near_planes ^ sizeof(float) * kWideBranching; }

namespace host_ray_detail {

/// Axes x, y, z of a sheared space.
struct ShearedAxes {
  alignas(16) std::int32_t order[4];
  std::size_t row[3];
};
constexpr std::size_t kRow = sizeof(PlanesLeaf{}.coordinate[0]);
inline constexpr ShearedAxes kAxes[3] = {
    {{1, 2, 0, 3}, {kRow, 2 * kRow, 0}}, {{2, 0, 1, 3}, {2 * kRow, 0, kRow}}, {{0, 1, 2, 3}, {0, kRow, 2 * kRow}}};
/// The axis of the largest component, as ShearedRay chooses it. Bits of the index: |x| > |y|, |x| > |z|, |y| > |z|.
inline constexpr std::uint8_t kLargest[8] = {2, 2, 2, 0, 1, 2, 1, 0};

/// @pre tmin and dz are set. @param reach from the origin to the scene's farthest plane.
HIPRT_FORCE_INLINE void set_least_depth(float reach, HostRay& to) {
  const float length = absolute(to.dz);
  // Less than the product by what a t below the normal range is off.
  to.least_depth = to.tmin * length - 0x1p-100f * (1.0f + length);
  to.slack = reach < 0x1p40f ? 0x1p-90f * max_of(reach, 1.0f) : std::numeric_limits<float>::infinity();
}

}  // namespace host_ray_detail

/// @return false: the ray misses everything (ray.h).
HIPRT_FORCE_INLINE bool prepare(const HostScene& scene, const Ray& ray, HostRay& to) {
  using namespace host_ray_detail;
  using Four = SimdLanes;
  using Float = Four::Float;
  static_assert(offsetof(Ray, tmin) == 3 * sizeof(float) && offsetof(Ray, direction) == 4 * sizeof(float));
  const Float three = _mm_castsi128_ps(_mm_set_epi32(0, -1, -1, -1));
  const Float from = _mm_loadu_ps(&ray.origin.x);  // And tmin.
  const Float origin = _mm_and_ps(from, three);
  const Float direction = _mm_and_ps(_mm_loadu_ps(&ray.direction.x), three);
  const Float length = Four::magnitude(direction);
  const unsigned larger = static_cast<unsigned>(
      _mm_movemask_ps(_mm_cmpgt_ps(Four::shuffle<0, 0, 1, 3>(length), Four::shuffle<1, 2, 2, 3>(length))));
  const ShearedAxes& axes = kAxes[kLargest[larger]];
  const __m128i order = _mm_load_si128(reinterpret_cast<const __m128i*>(axes.order));
  const Float sheared = _mm_permutevar_ps(direction, order);
  const Float dz = Four::shuffle<2, 2, 2, 2>(sheared);
  // |dz|. It is needed early, and sheared is late.
  const Float largest = Four::max(Four::max(Four::shuffle<0, 0, 0, 0>(length), Four::shuffle<1, 1, 1, 1>(length)),
                                  Four::shuffle<2, 2, 2, 2>(length));
  // Zero times a number that is not finite is NaN.
  const Float zero = Four::add(Four::mul(from, Four::all(0.0f)), Four::mul(direction, Four::all(0.0f)));
  const bool finite = Four::less_equal(zero, Four::all(0.0f)) == 0xfu;
  if (!(finite && Four::value(largest) > 0.0f && ray.tmin <= ray.tmax && ray.tmax >= 0.0f && ray.mask != 0))
    return false;

  // Slabs as RaySlabs prepares them. The margin is at least that of Conservative: an origin is no farther from zero
  // than the bounds' magnitude and reach together.
  const Float low = _mm_load_ps(scene.low), high = _mm_load_ps(scene.high);
  const Float away = Four::max(Four::sub(high, origin), Four::sub(origin, low));
  const Float reach = Four::max(Four::max(away, Four::shuffle<1, 1, 1, 1>(away)), Four::shuffle<2, 2, 2, 2>(away));
  const Float margin = Four::all(0x1p-24f * (28.0f * max_of(Four::value(reach), 0.0f) + 8.0f * scene.magnitude));
  constexpr float kMax = std::numeric_limits<float>::max();
  const auto in_range = [](Float a) { return Four::min(Four::max(a, Four::all(-kMax)), Four::all(kMax)); };
  const Float one = Four::all(1.0f);
  // A fourth lane of 1, so that no lane is slow.
  const Float raised = _mm_blend_ps(Four::max(length, Four::mul(largest, Four::all(0x1p-26f))), one, 8);
  const Float magnitude =
      Four::min(Four::max(Four::div(one, raised), Four::all(std::numeric_limits<float>::min())), Four::all(kMax));
  const Float rcp = Four::flip_sign(magnitude, direction);
  const Float widening = Four::mul(margin, magnitude);
  const Float offset = Four::mul(Four::flip_sign(origin, Four::all(-1.0f)), rcp);
  const Float near = in_range(Four::sub(offset, widening)), far = in_range(Four::add(offset, widening));
  const auto spread = [](WideLanes::Float(&axis)[3], Float of) {
    axis[0] = WideLanes::spread<0>(of);
    axis[1] = WideLanes::spread<1>(of);
    axis[2] = WideLanes::spread<2>(of);
  };
  spread(to.slabs.rcp, rcp);
  spread(to.slabs.near_offset, near);
  spread(to.slabs.far_offset, far);
  const unsigned down = static_cast<unsigned>(_mm_movemask_ps(direction));
  constexpr std::size_t kSide = sizeof(float) * kWideBranching;
  for (unsigned axis = 0; axis < 3; ++axis) to.slabs.near_planes[axis] = kSide * (2 * axis + (down >> axis & 1u));
  to.tmin = max_of(ray.tmin, 0.0f);
  to.slabs.begin = WideLanes::all(to.tmin);
  to.set_limit(ray.tmax < kMax ? ray.tmax : kMax);

  _mm_storeu_ps(to.origin, _mm_permutevar_ps(origin, order));
  _mm_storeu_ps(to.shear, Four::div(sheared, _mm_blend_ps(dz, one, 8)));
  for (unsigned axis = 0; axis < 3; ++axis) to.row[axis] = axes.row[axis];
  to.dz = Four::value(dz);
  set_least_depth(Four::value(reach), to);
  return true;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::format_detail
