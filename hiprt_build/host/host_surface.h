#pragma once
/// Normal and error bound of a hit on a leaf of layout planes: the results of complete() (intersect/hit_surface.h), in
/// vector registers. Internal; for sources compiled with AVX2 and FMA.

#include <hiprt_build/host/host_leaves.h>
#include <hiprt_device/intersect/hit_surface.h>

#include <cstring>

namespace hiprt::format_detail {
inline namespace HIPRT_ISA_NAMESPACE {

/// Sets the hit's normal and error.
/// @param of the hit's triangle.
HIPRT_FORCE_INLINE void complete_on_host(Hit& hit, const Ray& ray, const HostTriangle& of) {
  using Four = SimdLanes;
  std::uint32_t vertices;
  std::memcpy(&vertices, of.places().vertex, sizeof(vertices));
  const __m128i corners = _mm_cvtepu8_epi32(_mm_cvtsi32_si128(static_cast<int>(vertices)));
  Four::Float at[3];  // Per axis: corners 0, 1, 2 and 0 again.
  for (unsigned axis = 0; axis < 3; ++axis)
    at[axis] = _mm_permutevar_ps(Four::load(of.leaf->coordinate[axis]), corners);
  const auto largest_axis = [](Four::Float x, Four::Float y, Four::Float z) {
    return Four::max(Four::max(Four::magnitude(x), Four::magnitude(y)), Four::magnitude(z));
  };
  const auto edge = [&](unsigned axis) { return Four::sub(at[axis], Four::shuffle<1, 2, 0, 1>(at[axis])); };
  const Four::Float reaches =
      largest_axis(Four::sub(at[0], Four::all(ray.origin.x)), Four::sub(at[1], Four::all(ray.origin.y)),
                   Four::sub(at[2], Four::all(ray.origin.z)));
  const Four::Float extents = largest_axis(edge(0), edge(1), edge(2)), sizes = largest_axis(at[0], at[1], at[2]);
  const Four::Float both = Four::max(_mm_unpacklo_ps(reaches, extents), _mm_unpackhi_ps(reaches, extents));
  const Four::Float reach_and_extent = Four::max(both, _mm_movehl_ps(both, both));
  const Four::Float pair = Four::max(sizes, _mm_movehl_ps(sizes, sizes));
  const float magnitude = Four::value(Four::max(pair, Four::shuffle<1, 1, 1, 1>(pair)));
  hit.error =
      surface_detail::kUnit<float> *
      fused_multiply_add(20.0f, Four::get(reach_and_extent, 0) + Four::get(reach_and_extent, 1), 4.0f * magnitude);

  // The corners as points.
  const __m128 xy_low = _mm_unpacklo_ps(at[0], at[1]), xy_high = _mm_unpackhi_ps(at[0], at[1]);
  hit.normal = surface_detail::normal_of(_mm_shuffle_ps(xy_low, at[2], 0x04), _mm_shuffle_ps(xy_low, at[2], 0x5e),
                                         _mm_shuffle_ps(xy_high, at[2], 0xa4));
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::format_detail
