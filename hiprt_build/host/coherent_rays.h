#pragma once
/// Eight coherent rays, and the frustum around them. Internal; for sources compiled with AVX2 and FMA.

#include <hiprt_build/host/host_ray.h>

namespace hiprt::format_detail {
inline namespace HIPRT_ISA_NAMESPACE {

/// Rays that are traced at once.
inline constexpr unsigned kCoherentRays = 8;

namespace coherent_detail {

/// The eight rows become columns.
HIPRT_FORCE_INLINE void transpose(const __m256 (&row)[8], __m256 (&column)[8]) {
  __m256 pair[8], four[8];
  for (unsigned i = 0; i < 8; i += 2) {
    pair[i] = _mm256_unpacklo_ps(row[i], row[i + 1]);
    pair[i + 1] = _mm256_unpackhi_ps(row[i], row[i + 1]);
  }
  for (unsigned i = 0; i < 8; i += 4)
    for (unsigned k = 0; k < 2; ++k) {
      four[i + 2 * k] = _mm256_shuffle_ps(pair[i + k], pair[i + k + 2], 0x44);
      four[i + 2 * k + 1] = _mm256_shuffle_ps(pair[i + k], pair[i + k + 2], 0xee);
    }
  for (unsigned i = 0; i < 4; ++i) {
    column[i] = _mm256_permute2f128_ps(four[i], four[i + 4], 0x20);
    column[i + 4] = _mm256_permute2f128_ps(four[i], four[i + 4], 0x31);
  }
}

/// The smallest and the largest of eight numbers, in all lanes. @pre none is NaN
struct Range {
  WideLanes::Float low, high;

  HIPRT_FORCE_INLINE explicit Range(WideLanes::Float of) {
    // The high half has the numbers with the other sign.
    const __m128 a = _mm256_castps256_ps128(of), b = _mm256_extractf128_ps(of, 1), minus = _mm_set1_ps(-0.0f);
    __m256 least =
        _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_min_ps(a, b)), _mm_xor_ps(_mm_max_ps(a, b), minus), 1);
    least = _mm256_min_ps(least, _mm256_permute_ps(least, 0x4e));
    least = _mm256_min_ps(least, _mm256_permute_ps(least, 0xb1));
    low = _mm256_permute2f128_ps(least, least, 0x00);
    high = _mm256_xor_ps(_mm256_permute2f128_ps(least, least, 0x11), _mm256_set1_ps(-0.0f));
  }
};

}  // namespace coherent_detail

/// A vector per number, with a lane per ray.
class CoherentRays {
  using Lanes = WideLanes;

 public:
  using Float = Lanes::Float;

  Float tmin, limit;              ///< The part of the ray that is left.
  Float dz, origin[3], shear[2];  ///< In the sheared space, as those of HostRay.
  std::size_t row[3];             ///< As those of HostRay.
  std::size_t near_planes[3];
  Float rcp[3], near_offset[3], far_offset[3];  ///< As those of HostRay.
  // The frustum.
  Float least_rcp[3], most_rcp[3];      ///< Of the reciprocal directions.
  Float near_origin[3], far_origin[3];  ///< The origin that meets a plane first, and last; moved by the margin.

  /// @param rays kCoherentRays. @return false: they cannot be traced at once. They are all traceable, have the same
  /// signs and the same largest component, and are nearly parallel and close to each other.
  HIPRT_FORCE_INLINE bool prepare(const HostScene& scene, const Ray* rays) {
    static_assert(offsetof(Ray, tmin) == 12 && offsetof(Ray, direction) == 16 && offsetof(Ray, tmax) == 28);
    Float from_rays[8], column[8];
    for (unsigned i = 0; i < kCoherentRays; ++i) from_rays[i] = _mm256_loadu_ps(&rays[i].origin.x);
    coherent_detail::transpose(from_rays, column);
    const Float *const from = column, *const to = column + 4;
    tmin = Lanes::max(column[3], Lanes::all(0.0f));
    limit = Lanes::min(column[7], Lanes::all(std::numeric_limits<float>::max()));
    const Float size[3] = {Lanes::magnitude(to[0]), Lanes::magnitude(to[1]), Lanes::magnitude(to[2])};
    const std::uint32_t x_y = Lanes::greater(size[0], size[1]), x_z = Lanes::greater(size[0], size[2]),
                        y_z = Lanes::greater(size[1], size[2]);
    if (!(is_same(x_y) && is_same(x_z) && is_same(y_z))) return false;
    const auto& axes = host_ray_detail::kAxes[host_ray_detail::kLargest[(x_y & 1u) | (x_z & 2u) | (y_z & 4u)]];
    const Float largest = size[axes.order[2]];
    if (!are_traceable(column, largest, rays)) return false;
    const Float narrow = Lanes::mul(Lanes::all(0x1p-3f), largest);

    Float low[3], high[3];
    Float reach = Lanes::all(0.0f);
    for (unsigned axis = 0; axis < 3; ++axis) {
      const std::uint32_t down = static_cast<std::uint32_t>(_mm256_movemask_ps(to[axis]));
      if (down != 0 && down != 0xffu) return false;
      near_planes[axis] = sizeof(float) * kWideBranching * (2 * axis + (down & 1u));
      const coherent_detail::Range directions(to[axis]), origins(from[axis]);
      if (!(Lanes::value(Lanes::sub(directions.high, directions.low)) <= Lanes::value(narrow))) return false;
      low[axis] = origins.low;
      high[axis] = origins.high;
      if (!(Lanes::value(Lanes::sub(origins.high, origins.low)) <= 0x1p-5f * scene.extent)) return false;
      reach = Lanes::max(reach, Lanes::max(Lanes::sub(Lanes::all(scene.high[axis]), origins.low),
                                           Lanes::sub(origins.high, Lanes::all(scene.low[axis]))));
      const Float length = Lanes::max(size[axis], Lanes::mul(largest, Lanes::all(0x1p-26f)));
      rcp[axis] = Lanes::flip_sign(
          Lanes::min(Lanes::max(Lanes::div(Lanes::all(1.0f), length), Lanes::all(std::numeric_limits<float>::min())),
                     Lanes::all(std::numeric_limits<float>::max())),
          to[axis]);
      const coherent_detail::Range reciprocals(rcp[axis]);
      least_rcp[axis] = reciprocals.low;
      most_rcp[axis] = reciprocals.high;
    }
    const Float margin =
        Lanes::mul(Lanes::all(0x1p-24f), Lanes::fma(Lanes::all(28.0f), reach, Lanes::all(8.0f * scene.magnitude)));
    for (unsigned axis = 0; axis < 3; ++axis) {
      const Float later = Lanes::add(high[axis], margin), sooner = Lanes::sub(low[axis], margin);
      const bool down = near_planes[axis] != sizeof(float) * kWideBranching * 2 * axis;
      const Float widening = Lanes::mul(margin, Lanes::magnitude(rcp[axis]));
      const Float offset = Lanes::mul(Lanes::flip_sign(from[axis], Lanes::all(-1.0f)), rcp[axis]);
      near_offset[axis] = in_range(Lanes::sub(offset, widening));
      far_offset[axis] = in_range(Lanes::add(offset, widening));
      near_origin[axis] = down ? sooner : later;
      far_origin[axis] = down ? later : sooner;
    }

    for (unsigned axis = 0; axis < 3; ++axis) {
      origin[axis] = from[axes.order[axis]];
      row[axis] = axes.row[axis];
    }
    dz = to[axes.order[2]];
    shear[0] = Lanes::div(to[axes.order[0]], dz);
    shear[1] = Lanes::div(to[axes.order[1]], dz);
    return true;
  }

 private:
  static HIPRT_FORCE_INLINE Float in_range(Float a) {
    constexpr float kMax = std::numeric_limits<float>::max();
    return Lanes::min(Lanes::max(a, Lanes::all(-kMax)), Lanes::all(kMax));
  }
  static bool is_same(std::uint32_t bits) { return bits == 0 || bits == 0xffu; }
  /// As is_traceable() (intersect/box_ray.h). @param column origin, tmin, direction, tmax.
  static HIPRT_FORCE_INLINE bool are_traceable(const Float (&column)[8], Float largest, const Ray* rays) {
    const Float zero = Lanes::all(0.0f);
    Float sum = Lanes::mul(column[0], zero);
    for (unsigned i = 1; i < 7; ++i) sum = Lanes::add(sum, Lanes::mul(column[i], zero));
    std::uint32_t ok = Lanes::less_equal(sum, zero) & Lanes::greater(largest, zero) &
                       Lanes::less_equal(column[3], column[7]) & Lanes::less_equal(zero, column[7]);
    for (unsigned i = 0; i < kCoherentRays; ++i)
      if (rays[i].mask == 0) ok = 0;
    return ok == 0xffu;
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::format_detail
