#pragma once
/// The intersection of a ray and the four boxes of a node: slabs with one fused multiply-add per plane.
///
/// A margin in scene units covers the rounding of the box test and of the triangle test. It is computed once per ray,
/// so a conservative test costs nothing per node. docs/proofs/conservative-boxes.md proves the constants.

#include <hiprt_device/intersect/node_lanes.h>
#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The children that a ray meets, in the order of visits; then kInvalidRef.
struct SortedChildren {
  NodeRef child[kBranching];
};

/// How far a scene reaches, along any axis.
struct Extents {
  float reach;      ///< From a ray's origin.
  float magnitude;  ///< From zero.

  HIPRT_HD HIPRT_FORCE_INLINE Extents(const Vec3& origin, const Box& bounds) {
#if HIPRT_SIMD_LANES
    using Four = SimdLanes;
    const auto from = Four::set(origin.x, origin.y, origin.z, origin.z);
    const auto low = Four::set(bounds.min[0], bounds.min[1], bounds.min[2], bounds.min[2]);
    const auto high = Four::set(bounds.max[0], bounds.max[1], bounds.max[2], bounds.max[2]);
    const auto reaches = Four::max(Four::sub(high, from), Four::sub(from, low));
    const auto magnitudes = Four::max(Four::magnitude(high), Four::magnitude(low));
    const auto both = Four::max(_mm_unpacklo_ps(reaches, magnitudes), _mm_unpackhi_ps(reaches, magnitudes));
    const auto largest = Four::max(both, _mm_movehl_ps(both, both));
    reach = max_of(Four::get(largest, 0), 0.0f);
    magnitude = Four::get(largest, 1);
#else
    reach = magnitude = 0.0f;
    const auto read = [&](unsigned axis, float from) {
      reach = max_of(reach, max_of(bounds.max[axis] - from, from - bounds.min[axis]));
      magnitude = max_of(magnitude, max_of(absolute(bounds.max[axis]), absolute(bounds.min[axis])));
    };
    read(0, origin.x);
    read(1, origin.y);
    read(2, origin.z);
#endif
  }
};

/// Box test policy: every hit that the Watertight triangle test reports lies in boxes that pass. The default.
struct Conservative {
  /// @return by how much every box is widened, in scene units.
  HIPRT_HD static HIPRT_FORCE_INLINE float margin(const Vec3& origin, const Box& bounds) {
    return margin(origin, bounds, 0.0f, 0.0f);
  }
  /// The same for boxes of instances, whose transforms round too. docs/proofs/instances.md proves the constants.
  /// @param condition, transform_reach of the file's header.
  HIPRT_HD static HIPRT_FORCE_INLINE float margin(const Vec3& origin, const Box& bounds, float condition,
                                                  float transform_reach) {
    const Extents of(origin, bounds);
    const float reach = of.reach, magnitude = of.magnitude + max_component(origin);
    constexpr float kUnit = 0x1p-24f;
    const float own = 24.0f * reach + 4.0f * magnitude;
    // Not 0 times a number that may be infinite.
    if (!(condition > 0.0f)) return kUnit * own;
    return kUnit * (own + condition * (84.0f * reach + 25.0f * magnitude + 28.0f * transform_reach));
  }
};

/// Box test policy: slabs without a margin. It loses hits near box faces.
struct Plain {
  HIPRT_HD static HIPRT_FORCE_INLINE float margin(const Vec3&, const Box&) { return 0.0f; }
  HIPRT_HD static HIPRT_FORCE_INLINE float margin(const Vec3&, const Box&, float, float) { return 0.0f; }
};

/// Replaces an infinity by the largest float, for rays outside the range of the guarantees (ray.h).
///
/// An infinite offset would give inf - inf = NaN at the planes of absent children. Those could then pass and lead out
/// of the file. A NaN becomes a number too.
HIPRT_HD HIPRT_FORCE_INLINE float within_range(float a) {
  constexpr float kMax = std::numeric_limits<float>::max();
  return smaller(larger(a, -kMax), kMax);
}

/// 1 / a within one unit in the last place. For boxes only, because machines differ.
/// @pre a is 0 or normal
HIPRT_HD HIPRT_FORCE_INLINE float reciprocal(float a) {
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
  return __builtin_amdgcn_rcpf(a);
#elif HIPRT_DEVICE_CODE
  float result;
  asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(result) : "f"(a));
  return result;
#else
  return 1.0f / a;
#endif
}

/// The numbers from which RaySlabs are made again without a division.
struct SavedSlabs {
  float rcp[3], margin;
};

/// A ray prepared for slabs: the distance to a plane p of axis k is p * rcp[k] + offset[k].
template <class Lanes> struct RaySlabs {
  typename Lanes::Uniform rcp[3];
  typename Lanes::Uniform near_offset[3];
  typename Lanes::Uniform far_offset[3];

  /// Whether the ray meets the maximum plane first.
  HIPRT_HD HIPRT_FORCE_INLINE bool is_down(unsigned axis) const {
    return std::bit_cast<std::int32_t>(Lanes::value(rcp[axis])) < 0;
  }
  /// The plane that the ray meets first: 0 minimum, 1 maximum.
  HIPRT_HD HIPRT_FORCE_INLINE unsigned near_side(unsigned axis) const {
    return std::bit_cast<std::uint32_t>(Lanes::value(rcp[axis])) >> 31;
  }

  /// Raises direction components below 2^-26 of the largest to that value, for boxes only.
  ///
  /// The ray then moves by less than the margin within [tmin, tmax] and the scene. So no reciprocal is infinite and no
  /// product is 0 * inf.
  /// @param start t from which distances are counted: 0, or with kComparesBits from 0 to the ray's tmin.
  HIPRT_HD HIPRT_FORCE_INLINE RaySlabs(const Ray& ray, float margin, float start = 0.0f) {
    const float floor = max_component(ray.direction) * 0x1p-26f;
#if HIPRT_SIMD_LANES
    if constexpr (!Lanes::kScalar) {
      prepare_axes(ray, floor, margin);
      return;
    }
#endif
    prepare(0, ray.origin.x, ray.direction.x, floor, margin, start);
    prepare(1, ray.origin.y, ray.direction.y, floor, margin, start);
    prepare(2, ray.origin.z, ray.direction.z, floor, margin, start);
  }

  /// @param origin of the ray whose slabs were saved. @param start as it was.
  HIPRT_HD HIPRT_FORCE_INLINE RaySlabs(const SavedSlabs& saved, const Vec3& origin, float start = 0.0f) {
    put(0, origin.x, saved.rcp[0], saved.margin, start);
    put(1, origin.y, saved.rcp[1], saved.margin, start);
    put(2, origin.z, saved.rcp[2], saved.margin, start);
  }
  /// @param margin with which the slabs were made.
  HIPRT_HD HIPRT_FORCE_INLINE void save(SavedSlabs& saved, float margin) const {
    saved.rcp[0] = Lanes::value(rcp[0]);
    saved.rcp[1] = Lanes::value(rcp[1]);
    saved.rcp[2] = Lanes::value(rcp[2]);
    saved.margin = margin;
  }

 private:
  HIPRT_HD HIPRT_FORCE_INLINE void prepare(unsigned axis, float origin, float direction, float floor, float margin,
                                           float start) {
    const bool down = std::bit_cast<std::int32_t>(direction) < 0;
    const float length = max_of(absolute(direction), floor);
    const float magnitude = within_range(max_of(reciprocal(length), std::numeric_limits<float>::min()));
    put(axis, origin, down ? -magnitude : magnitude, margin, start);
  }
#if HIPRT_SIMD_LANES
  /// prepare() for all axes at once, with the same results.
  HIPRT_FORCE_INLINE void prepare_axes(const Ray& ray, float floor, float margin) {
    using Four = SimdLanes;
    const auto in_range = [](typename Four::Float a) {
      constexpr float kMax = std::numeric_limits<float>::max();
      return Four::min(Four::max(a, Four::all(-kMax)), Four::all(kMax));
    };
    // A fourth lane of 1, so that no lane is slow.
    const auto direction = Four::set(ray.direction.x, ray.direction.y, ray.direction.z, 1.0f);
    const auto origin = Four::set(ray.origin.x, ray.origin.y, ray.origin.z, 1.0f);
    const auto length = Four::max(Four::magnitude(direction), Four::all(floor));
    const auto magnitude =
        in_range(Four::max(Four::div(Four::all(1.0f), length), Four::all(std::numeric_limits<float>::min())));
    const auto signed_rcp = Four::flip_sign(magnitude, direction);
    const auto widening = Four::mul(Four::all(margin), Four::magnitude(magnitude));
    const auto offset = Four::mul(Four::flip_sign(origin, Four::all(-1.0f)), signed_rcp);
    const auto near = in_range(Four::sub(offset, widening)), far = in_range(Four::add(offset, widening));
    put_axis<0>(signed_rcp, near, far);
    put_axis<1>(signed_rcp, near, far);
    put_axis<2>(signed_rcp, near, far);
  }
  template <int kAxis>
  HIPRT_FORCE_INLINE void put_axis(SimdLanes::Float signed_rcp, SimdLanes::Float near, SimdLanes::Float far) {
    rcp[kAxis] = Lanes::template spread<kAxis>(signed_rcp);
    near_offset[kAxis] = Lanes::template spread<kAxis>(near);
    far_offset[kAxis] = Lanes::template spread<kAxis>(far);
  }
#endif
  HIPRT_HD HIPRT_FORCE_INLINE void put(unsigned axis, float origin, float signed_rcp, float margin, float start) {
    const float widening = margin * absolute(signed_rcp);
    const float offset = -origin * signed_rcp;
    rcp[axis] = Lanes::uniform(signed_rcp);
    near_offset[axis] = Lanes::uniform(within_range(offset - widening - start));
    far_offset[axis] = Lanes::uniform(within_range(offset + widening - start));
  }
};

/// The children that a ray meets, and where it enters their boxes.
template <class Lanes> struct BoxHits {
  std::uint32_t mask;           ///< Bit per child.
  typename Lanes::Float enter;  ///< t of entry (at least tmin) where the bit is set.

  HIPRT_HD HIPRT_FORCE_INLINE BoxHits(const typename Lanes::Float& first, const typename Lanes::Float& last,
                                      std::uint32_t present)
      : mask(Lanes::less_equal(first, last) & present), enter(first) {}
  HIPRT_HD HIPRT_FORCE_INLINE bool hit(unsigned child) const { return (mask >> child & 1u) != 0; }
  HIPRT_HD HIPRT_FORCE_INLINE bool any() const { return mask != 0; }
};

/// The same as comparisons, which a GPU keeps in predicates.
template <class Lanes>
requires(Lanes::kScalar) struct BoxHits<Lanes> {
  bool met[kBranching];
  typename Lanes::Float enter;

  HIPRT_HD HIPRT_FORCE_INLINE BoxHits(const typename Lanes::Float& first, const typename Lanes::Float& last,
                                      std::uint32_t present)
      : met{meets(first, last, present, 0), meets(first, last, present, 1), meets(first, last, present, 2),
            meets(first, last, present, 3)},
        enter(first) {}
  HIPRT_HD HIPRT_FORCE_INLINE bool hit(unsigned child) const { return met[child]; }
  HIPRT_HD HIPRT_FORCE_INLINE bool any() const { return met[0] | met[1] | met[2] | met[3]; }
  /// The children that the ray enters at @p limit or before.
  HIPRT_HD HIPRT_FORCE_INLINE BoxHits within(float limit) const {
    BoxHits result = *this;
    for (unsigned i = 0; i < kBranching; ++i) result.met[i] = met[i] && Lanes::get(enter, i) <= limit;
    return result;
  }

  /// The hits of slabs by bits. The ray begins at 0, so a box that it leaves at a negative distance is behind it.
  /// @param first, last first_by_bits() and last_by_bits(). If both are negative, the box is behind the ray. Then in
  /// one axis the ray leaves at last's distance or nearer to 0, and has entered before. So the bits of first are above
  /// those of last, unless the box has no width there and no margin: it may pass.
  HIPRT_HD static HIPRT_FORCE_INLINE BoxHits by_bits(const typename Lanes::Float& first,
                                                     const typename Lanes::Float& last, std::uint32_t present) {
    BoxHits result(first, last, present);
    for (unsigned i = 0; i < kBranching; ++i)
      result.met[i] =
          std::bit_cast<std::int32_t>(Lanes::get(first, i)) <= std::bit_cast<std::int32_t>(Lanes::get(last, i)) &&
          (present & (1u << i)) != 0;
    return result;
  }

 private:
  HIPRT_HD static HIPRT_FORCE_INLINE bool meets(const typename Lanes::Float& first, const typename Lanes::Float& last,
                                                std::uint32_t present, unsigned child) {
    return Lanes::get(first, child) <= Lanes::get(last, child) && (present & (1u << child)) != 0;
  }
};

/// A ray in the units of a node's planes: those of the scene, or those of the node's grid.
template <class Lanes, class Node> struct NodeSlabs {
  const RaySlabs<Lanes>& ray;
  HIPRT_HD HIPRT_FORCE_INLINE NodeSlabs(const Node&, const RaySlabs<Lanes>& of) : ray(of) {}
  HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Uniform rcp(unsigned axis) const { return ray.rcp[axis]; }
  HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Uniform near_offset(unsigned axis) const { return ray.near_offset[axis]; }
  HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Uniform far_offset(unsigned axis) const { return ray.far_offset[axis]; }
};

/// (origin + q * scale) * rcp + offset = q * (scale * rcp) + (origin * rcp + offset).
///
/// The product with the power of two is exact. The sum in the second bracket is one more rounding, which the margin
/// covers (docs/decisions/0003-conservative-boxes.md).
///
/// Where bytes have a bias (lanes.h), the bias goes into the second bracket. Its rounding is then up to 2^-8 of the
/// grid's step, and boxes grow by twice that.
template <class Lanes> struct NodeSlabs<Lanes, QuantizedBoxNode> {
  const RaySlabs<Lanes>& ray;
  Words grid;
  HIPRT_HD HIPRT_FORCE_INLINE NodeSlabs(const QuantizedBoxNode& node, const RaySlabs<Lanes>& of)
      : ray(of), grid(load_words(node.origin)) {}
  HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Uniform rcp(unsigned axis) const {
    // The exponent's byte, moved to the exponent of a float.
    const std::uint32_t bits = axis == 0   ? grid.word[3] << 23 & 0x7f800000u
                               : axis == 1 ? grid.word[3] << 15 & 0x7f800000u
                                           : grid.word[3] << 7 & 0x7f800000u;
    return Lanes::uniform(std::bit_cast<float>(bits)) * ray.rcp[axis];
  }
  HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Uniform near_offset(unsigned axis) const {
    return biased(axis, ray.near_offset[axis], !ray.is_down(axis));
  }
  HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Uniform far_offset(unsigned axis) const {
    return biased(axis, ray.far_offset[axis], ray.is_down(axis));
  }

 private:
  HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Uniform biased(unsigned axis, typename Lanes::Uniform offset,
                                                             bool more) const {
    const auto plain = uniform_madd(Lanes::uniform(grid.as_float(axis)), ray.rcp[axis], offset);
    if constexpr (Lanes::kByteBias == 0.0f) return plain;
    constexpr float kStep = 0x1p-7f;
    const float bias = more ? -(Lanes::kByteBias + kStep) : -(Lanes::kByteBias - kStep);
    return uniform_madd(Lanes::uniform(bias), rcp(axis), plain);
  }
  HIPRT_HD static HIPRT_FORCE_INLINE float uniform_madd(float a, float b, float c) { return multiply_add(a, b, c); }
  // For hosts only: vector registers.
  template <class Vector> HIPRT_HD static HIPRT_FORCE_INLINE Vector uniform_madd(Vector a, Vector b, Vector c) {
    return Lanes::madd(a, b, c);
  }
};

namespace box_test_detail {

/// Where a ray enters and leaves the four slabs of an axis. A class, because NVRTC treats generic lambdas as host code.
template <class Lanes, class Node> class FourSlabs {
 public:
  HIPRT_HD HIPRT_FORCE_INLINE FourSlabs(const Node& node, const RaySlabs<Lanes>& ray)
      : node_(node), ray_(ray), slabs_(node, ray) {}

  HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float enter(unsigned axis) const {
#if defined(__CUDA_ARCH__)
    const auto planes = load_side<Lanes, false>(node_, axis, ray_.near_side(axis));
#else
    const auto planes = load_planes<Lanes>(node_, axis, ray_.near_side(axis));
#endif
    return Lanes::madd(planes, slabs_.rcp(axis), slabs_.near_offset(axis));
  }
  HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float leave(unsigned axis) const {
#if defined(__CUDA_ARCH__)
    const auto planes = load_side<Lanes, true>(node_, axis, ray_.near_side(axis));
#else
    const auto planes = load_planes<Lanes>(node_, axis, ray_.near_side(axis) ^ 1u);
#endif
    return Lanes::madd(planes, slabs_.rcp(axis), slabs_.far_offset(axis));
  }

 private:
  const Node& node_;
  const RaySlabs<Lanes>& ray_;
  const NodeSlabs<Lanes, Node> slabs_;
};

}  // namespace box_test_detail

/// Tests the ray from where its distances are counted. Absent children are never hit.
///
/// BoxHits::enter is negative where the ray begins inside of the box.
template <class Lanes, class Node>
requires(Lanes::kComparesBits)
    HIPRT_HD HIPRT_FORCE_INLINE BoxHits<Lanes> intersect_boxes(const Node& node, const RaySlabs<Lanes>& ray) {
  // Calls, not loops over arrays: GCC would keep the loops, and the arrays in memory.
  const box_test_detail::FourSlabs<Lanes, Node> slabs(node, ray);
  const auto first = Lanes::first_by_bits(slabs.enter(0), slabs.enter(1), slabs.enter(2));
  const auto last = Lanes::last_by_bits(slabs.leave(0), slabs.leave(1), slabs.leave(2));
  return BoxHits<Lanes>::by_bits(first, last, load_present(node));
}

/// Tests the part [tmin, tmax] of the ray. Absent children are never hit.
/// @pre with kComparesBits tmin is 0
template <class Lanes, class Node>
HIPRT_HD HIPRT_FORCE_INLINE BoxHits<Lanes> intersect_boxes(const Node& node, const RaySlabs<Lanes>& ray,
                                                           typename Lanes::Uniform tmin, typename Lanes::Uniform tmax) {
  if constexpr (Lanes::kComparesBits) {
    return intersect_boxes<Lanes>(node, ray).within(tmax);
  } else {
    const box_test_detail::FourSlabs<Lanes, Node> slabs(node, ray);
    const auto first = Lanes::first_in(slabs.enter(0), slabs.enter(1), slabs.enter(2), tmin);
    const auto last = Lanes::last_in(slabs.leave(0), slabs.leave(1), slabs.leave(2), tmax);
    return {first, last, load_present(node)};
  }
}

/// Whether the part [tmin, tmax] of the ray meets one box.
template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE bool meets_box(const Box& box, const RaySlabs<Lanes>& ray, float tmin, float tmax) {
  float first = tmin, last = tmax;
  const auto clip = [&](unsigned axis) HIPRT_FORCE_INLINE_LAMBDA {
    const bool down = ray.is_down(axis);
    const float near_plane = down ? box.max[axis] : box.min[axis], far_plane = down ? box.min[axis] : box.max[axis];
    const float rcp = Lanes::value(ray.rcp[axis]);
    first = max_of(first, multiply_add(near_plane, rcp, Lanes::value(ray.near_offset[axis])));
    const float leave = multiply_add(far_plane, rcp, Lanes::value(ray.far_offset[axis]));
    last = leave < last ? leave : last;
  };
  clip(0);
  clip(1);
  clip(2);
  return first <= last;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
