#pragma once
/// The space in which triangles are tested. It is sheared so that the ray is the z axis (Woop, Benthin, Wald,
/// "Watertight ray/triangle intersection", 2013). The ray hits a triangle if the signs of its three edge functions
/// agree.

#include <hiprt_device/intersect/candidate.h>
#include <hiprt_device/intersect/node_lanes.h>
#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A ray as the z axis of a sheared space.
template <class Lanes> struct ShearedRay {
  unsigned z;                                  ///< Axis of the largest direction component.
  typename Lanes::Uniform ox, oy, oz, sx, sy;  ///< Origin and shear: direction x / z and y / z.

  using Real = typename Lanes::Scalar;

  HIPRT_HD HIPRT_FORCE_INLINE explicit ShearedRay(const BasicRay<Real>& ray) {
    const Real ax = absolute(ray.direction.x), ay = absolute(ray.direction.y), az = absolute(ray.direction.z);
    z = ax > ay ? (ax > az ? 0u : 2u) : (ay > az ? 1u : 2u);
    const Real dz = component(ray.direction, z);
    sx = Lanes::uniform(divided(component(ray.direction, x()), dz));
    sy = Lanes::uniform(divided(component(ray.direction, y()), dz));
    ox = Lanes::uniform(component_by_choice(ray.origin, x()));
    oy = Lanes::uniform(component_by_choice(ray.origin, y()));
    oz = Lanes::uniform(component_by_choice(ray.origin, z));
  }
  /// The other axes, 1, 2, 0 and 2, 0, 1 for z = 0, 1, 2, with two bits each.
  HIPRT_HD HIPRT_FORCE_INLINE unsigned x() const { return 0b00'10'01u >> 2 * z & 3u; }
  HIPRT_HD HIPRT_FORCE_INLINE unsigned y() const { return 0b01'00'10u >> 2 * z & 3u; }
  /// Selects a component. Indexing a vector at run time would move it to memory on a GPU.
  HIPRT_HD static HIPRT_FORCE_INLINE Real component(const BasicVec3<Real>& v, unsigned axis) {
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
  }
  /// component() without the branches that clang makes of it for AMD. Only origins use it: kernels without any branch
  /// need more registers.
  HIPRT_HD static HIPRT_FORCE_INLINE Real component_by_choice(const BasicVec3<Real>& v, unsigned axis) {
    return choose(axis == 0, v.x, choose(axis == 1, v.y, v.z));
  }
};

/// A leaf's vertices in the ray's sheared space.
template <class Lanes> struct ShearedVertices {
  typename Lanes::Float x, y, z;
  template <class Leaf, class Ray>
  HIPRT_HD HIPRT_FORCE_INLINE ShearedVertices(const Leaf& leaf, const Ray& ray)
      : z(Lanes::sub(load_coordinates<Lanes>(leaf, ray.z), ray.oz)) {
    x = Lanes::fnma(ray.sx, z, Lanes::sub(load_coordinates<Lanes>(leaf, ray.x()), ray.ox));
    y = Lanes::fnma(ray.sy, z, Lanes::sub(load_coordinates<Lanes>(leaf, ray.y()), ray.oy));
  }
};

/// a * d - b * c within 2 units of 2^-24 (in double 2^-53), sign exact (Kahan; Jeannerod, Louvet, Muller 2013).
template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float difference_of_products(const typename Lanes::Float& a,
                                                                         const typename Lanes::Float& d,
                                                                         const typename Lanes::Float& b,
                                                                         const typename Lanes::Float& c) {
  const auto product = Lanes::mul(b, c);
  return Lanes::add(Lanes::fms(a, d, product), Lanes::fnma(b, c, product));
}

/// Edge functions and depths of one triangle of a leaf, in stored order.
template <class Real> struct TriangleCorners {
  Real weight[3];  ///< Edge function opposite to the corner, unnormalised.
  Real z[3];
  Real uncertainty;

  HIPRT_HD HIPRT_FORCE_INLINE bool are_certain() const {
    return absolute(weight[0]) > uncertainty && absolute(weight[1]) > uncertainty && absolute(weight[2]) > uncertainty;
  }
};

/// The signs of both triangles' edge functions, as bits: edges around the leaf, then the shared edge and back.
template <class Lanes> class EdgeSigns {
 public:
  HIPRT_HD HIPRT_FORCE_INLINE EdgeSigns(const typename Lanes::Float& around, const typename Lanes::Float& shared,
                                        typename Lanes::Scalar uncertainty) {
    const auto least = Lanes::all(uncertainty), most = Lanes::all(-uncertainty);
    positive_ = Lanes::greater(around, least) | Lanes::greater(shared, least) << 4;
    negative_ = Lanes::greater(most, around) | Lanes::greater(most, shared) << 4;
  }
  /// Whether no edge function is certainly positive, or none certainly negative.
  HIPRT_HD HIPRT_FORCE_INLINE bool meets0() const { return (positive_ & kEdges0) == 0 || (negative_ & kEdges0) == 0; }
  HIPRT_HD HIPRT_FORCE_INLINE bool meets1() const { return (positive_ & kEdges1) == 0 || (negative_ & kEdges1) == 0; }

 private:
  static constexpr std::uint32_t kEdges0 = 0b01'1001, kEdges1 = 0b10'0110;
  std::uint32_t positive_, negative_;
};

/// The same as comparisons: a GPU combines them as it computes them.
template <class Lanes>
requires(Lanes::kScalar) class EdgeSigns<Lanes> {
 public:
  HIPRT_HD HIPRT_FORCE_INLINE EdgeSigns(const typename Lanes::Float& around, const typename Lanes::Float& shared,
                                        typename Lanes::Scalar uncertainty)
      : first_{Lanes::get(around, 0), Lanes::get(around, 3), Lanes::get(shared, 0)},
        second_{Lanes::get(around, 1), Lanes::get(around, 2), Lanes::get(shared, 1)},
        uncertainty_(uncertainty) {}
  HIPRT_HD HIPRT_FORCE_INLINE bool meets0() const { return meets(first_); }
  HIPRT_HD HIPRT_FORCE_INLINE bool meets1() const { return meets(second_); }

 private:
  using Real = typename Lanes::Scalar;
  HIPRT_HD HIPRT_FORCE_INLINE bool meets(const Real (&edge)[3]) const {
    const Real least = uncertainty_, most = -uncertainty_;
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__) && !defined(__GFX9__)
    // AMD has the extreme of three numbers in one instruction. It ignores NaNs, as the comparisons do. On gfx9 clang 21
    // would use four registers more.
    if constexpr (std::is_same_v<Real, float>) {
      const bool positive = larger(larger(edge[0], edge[1]), edge[2]) > least;
      const bool negative = smaller(smaller(edge[0], edge[1]), edge[2]) < most;
      return !(positive & negative);
    }
#endif
    const bool positive = (edge[0] > least) | (edge[1] > least) | (edge[2] > least);
    const bool negative = (edge[0] < most) | (edge[1] < most) | (edge[2] < most);
    return !(positive & negative);
  }
  Real first_[3], second_[3], uncertainty_;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
