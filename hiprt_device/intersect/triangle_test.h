#pragma once
/// Ray against the two triangles of a leaf. A test policy prepares a ray once and answers with candidates: t, u, v of
/// the triangles the line meets; the query then looks at [tmin, tmax].

#include <hiprt_device/intersect/box_test.h>
#include <hiprt_device/intersect/node_lanes.h>
#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Where a line meets a triangle; u, v are weights of the mesh's corners 1 and 2.
template <class Real> struct BasicCandidate { Real t, u, v; };
using Candidate = BasicCandidate<float>;

/// Values, not variables: some compilers choose between addresses, which puts the variables into memory.
template <class T> HIPRT_HD HIPRT_INLINE T choose(bool condition, T a, T b) { return condition ? +a : +b; }

/// A weight, depth or vertex per corner of the mesh's triangle, from values in stored order.
template <class T> HIPRT_HD HIPRT_INLINE void to_mesh_order(T (&value)[3], std::uint32_t triangle_id) {
  const unsigned one = TriangleId::u_source(triangle_id), two = TriangleId::v_source(triangle_id);
  const T a = value[0], b = value[1], c = value[2];
  value[0] = choose(one + two == 3, a, choose(one + two == 2, b, c));
  value[1] = choose(one == 0, a, choose(one == 1, b, c));
  value[2] = choose(two == 0, a, choose(two == 1, b, c));
}

/// Which triangles of a leaf a line meets, from the signs of edge functions in a space where the ray is the z axis
/// (Woop, Benthin, Wald 2013). Edge functions are differences of products after Kahan with explicit fused
/// multiply-adds, whose sign is exact as long as nothing underflows or overflows. Every vertex is sheared the same way
/// in every triangle. Results do not depend on how triangles were paired, rotated or laid out.
/// @tparam Test the policy: PreparedRay, a ShearedRay; uncertainty(sheared vertices, ray), up to which an edge
/// function's sign may be another than the one to decide by; and finish(), which looks closer and makes the candidate.
template <class Test> struct ShearedTriangleTest {
  /// A leaf's vertices in the ray's sheared space.
  template <class Lanes> struct Sheared {
    typename Lanes::Float x, y, z;
    template <class Leaf, class Ray>
    HIPRT_HD HIPRT_INLINE Sheared(const Leaf& leaf, const Ray& ray)
        : z(Lanes::sub(load_coordinates<Lanes>(leaf, ray.z), ray.oz)) {
      x = Lanes::fnma(ray.sx, z, Lanes::sub(load_coordinates<Lanes>(leaf, ray.x()), ray.ox));
      y = Lanes::fnma(ray.sy, z, Lanes::sub(load_coordinates<Lanes>(leaf, ray.y()), ray.oy));
    }
  };

  /// In stored order.
  template <class Real> struct Corners {
    Real weight[3];  ///< Edge function opposite to the corner, unnormalised.
    Real z[3];
    Real uncertainty;

    HIPRT_HD HIPRT_INLINE bool are_certain() const {
      return absolute(weight[0]) > uncertainty && absolute(weight[1]) > uncertainty &&
             absolute(weight[2]) > uncertainty;
    }
  };

  /// Calls accept(candidate, triangle) for each of the leaf's triangles that the line meets, triangle 0 first;
  /// stops when it returns false. @return false if it was stopped.
  /// @param info the leaf's.
  template <class Lanes, class Leaf, class Ray, class Accept>
  HIPRT_HD static HIPRT_INLINE bool meet(const Leaf& leaf, const LeafInfo& info, const Ray& ray, Accept&& accept) {
    using Float = typename Lanes::Float;
    using Real = typename Lanes::Scalar;
    const Sheared<Lanes> at(leaf, ray);
    // Lanes: edges v0 v1, v1 v3, v3 v2, v2 v0 around both triangles; then the shared edge v1 v2 and back.
    const Float around = difference_of_products<Lanes>(
        Lanes::template shuffle<0, 1, 3, 2>(at.x), Lanes::template shuffle<1, 3, 2, 0>(at.y),
        Lanes::template shuffle<0, 1, 3, 2>(at.y), Lanes::template shuffle<1, 3, 2, 0>(at.x));
    const Float shared = difference_of_products<Lanes>(
        Lanes::template shuffle<1, 2, 1, 2>(at.x), Lanes::template shuffle<2, 1, 2, 1>(at.y),
        Lanes::template shuffle<1, 2, 1, 2>(at.y), Lanes::template shuffle<2, 1, 2, 1>(at.x));
    const Real uncertainty = Test::template uncertainty<Lanes>(at, ray);
    const EdgeSigns<Lanes> signs(around, shared, uncertainty);
    const bool meets0 = signs.meets0(), meets1 = signs.meets1();
    if (!meets0 && !meets1) return true;
    const Real e0 = Lanes::get(around, 0), e1 = Lanes::get(around, 1), e2 = Lanes::get(around, 2),
               e3 = Lanes::get(around, 3), s0 = Lanes::get(shared, 0), s1 = Lanes::get(shared, 1);
    const Real z0 = Lanes::get(at.z, 0), z1 = Lanes::get(at.z, 1), z2 = Lanes::get(at.z, 2), z3 = Lanes::get(at.z, 3);
    // One text for both triangles: the lanes of a wave do the first hit of their leaves together, whichever it is.
    for (bool second = !meets0, more = meets0 && meets1;; second = true, more = false) {
      const Corners<Real> corners{{choose(second, e2, s0), choose(second, s1, e3), choose(second, e1, e0)},
                                  {choose(second, z1, z0), choose(second, z3, z1), z2},
                                  uncertainty};
      const std::uint32_t id = second ? info.triangle_ids >> 8 : info.triangle_ids;
      BasicCandidate<Real> candidate;
      if (Test::template finish<Lanes>(corners, leaf, ray, second, id, candidate) &&
          !accept(candidate, second ? 1u : 0u))
        return false;
      if (!more) return true;
    }
  }

 protected:
  /// An edge function beyond this cannot have lost its sign to underflow: one of its products is beyond 2^-100, so
  /// the error term of Kahan's method is exact.
  static constexpr float kTiny = 0x1p-98f;

  /// In the precision of the corners.
  template <class Real>
  HIPRT_HD static HIPRT_INLINE void finish_quickly(Corners<Real> corners, std::uint32_t id, Real dz,
                                                   BasicCandidate<Real>& result) {
    to_mesh_order(corners.weight, id);
    to_mesh_order(corners.z, id);
    const Real(&w)[3] = corners.weight;
    const Real reciprocal = divided(Real(1), w[0] + w[1] + w[2]);
    result.u = w[1] * reciprocal;
    result.v = w[2] * reciprocal;
    const Real depth = fused_multiply_add(w[0] * reciprocal, corners.z[0],
                                          fused_multiply_add(result.u, corners.z[1], result.v * corners.z[2]));
    result.t = divided(depth, dz);
  }

  /// The triangle's corners in the mesh's order. @param of a value per vertex of the leaf.
  template <class Lanes>
  HIPRT_HD static HIPRT_INLINE void corners_of(const typename Lanes::Float& of, bool second, std::uint32_t id,
                                               typename Lanes::Scalar (&corner)[3]) {
    const typename Lanes::Scalar v0 = Lanes::get(of, 0), v1 = Lanes::get(of, 1), v2 = Lanes::get(of, 2),
                                 v3 = Lanes::get(of, 3);
    corner[0] = choose(second, v1, v0);
    corner[1] = choose(second, v3, v1);
    corner[2] = v2;
    to_mesh_order(corner, id);
  }

 private:
  /// The signs of both triangles' edge functions, as bits: edges around the leaf, then the shared edge and back.
  template <class Lanes> class EdgeSigns {
   public:
    HIPRT_HD HIPRT_INLINE EdgeSigns(const typename Lanes::Float& around, const typename Lanes::Float& shared,
                                    typename Lanes::Scalar uncertainty) {
      const auto least = Lanes::all(uncertainty), most = Lanes::all(-uncertainty);
      positive_ = Lanes::greater(around, least) | Lanes::greater(shared, least) << 4;
      negative_ = Lanes::greater(most, around) | Lanes::greater(most, shared) << 4;
    }
    /// No edge function is certainly positive, or none certainly negative.
    HIPRT_HD HIPRT_INLINE bool meets0() const { return (positive_ & kEdges0) == 0 || (negative_ & kEdges0) == 0; }
    HIPRT_HD HIPRT_INLINE bool meets1() const { return (positive_ & kEdges1) == 0 || (negative_ & kEdges1) == 0; }

   private:
    static constexpr std::uint32_t kEdges0 = 0b01'1001, kEdges1 = 0b10'0110;
    std::uint32_t positive_, negative_;
  };

  /// The same as comparisons: a GPU combines them as it makes them.
  template <class Lanes>
  requires(Lanes::kScalar) class EdgeSigns<Lanes> {
   public:
    HIPRT_HD HIPRT_INLINE EdgeSigns(const typename Lanes::Float& around, const typename Lanes::Float& shared,
                                    typename Lanes::Scalar uncertainty)
        : first_{Lanes::get(around, 0), Lanes::get(around, 3), Lanes::get(shared, 0)},
          second_{Lanes::get(around, 1), Lanes::get(around, 2), Lanes::get(shared, 1)},
          uncertainty_(uncertainty) {}
    HIPRT_HD HIPRT_INLINE bool meets0() const { return meets(first_); }
    HIPRT_HD HIPRT_INLINE bool meets1() const { return meets(second_); }

   private:
    using Real = typename Lanes::Scalar;
    HIPRT_HD HIPRT_INLINE bool meets(const Real (&edge)[3]) const {
      const Real least = uncertainty_, most = -uncertainty_;
      const bool positive = (edge[0] > least) | (edge[1] > least) | (edge[2] > least);
      const bool negative = (edge[0] < most) | (edge[1] < most) | (edge[2] < most);
      return !(positive & negative);
    }
    Real first_[3], second_[3], uncertainty_;
  };

  /// a * d - b * c within 2 units of 2^-24 (in double 2^-53), sign exact (Kahan; Jeannerod, Louvet, Muller 2013).
  template <class Lanes>
  HIPRT_HD static HIPRT_INLINE typename Lanes::Float difference_of_products(const typename Lanes::Float& a,
                                                                            const typename Lanes::Float& d,
                                                                            const typename Lanes::Float& b,
                                                                            const typename Lanes::Float& c) {
    const auto product = Lanes::mul(b, c);
    return Lanes::add(Lanes::fms(a, d, product), Lanes::fnma(b, c, product));
  }
};

/// A ray as the z axis of a sheared space.
template <class Lanes> struct ShearedRay {
  unsigned z;                                  ///< Axis of the largest direction component.
  typename Lanes::Uniform ox, oy, oz, sx, sy;  ///< Origin and shear: direction x / z and y / z.

  using Real = typename Lanes::Scalar;

  HIPRT_HD HIPRT_INLINE explicit ShearedRay(const BasicRay<Real>& ray) {
    const Real ax = absolute(ray.direction.x), ay = absolute(ray.direction.y), az = absolute(ray.direction.z);
    z = ax > ay ? (ax > az ? 0u : 2u) : (ay > az ? 1u : 2u);
    const Real dz = component(ray.direction, z);
    sx = Lanes::uniform(divided(component(ray.direction, x()), dz));
    sy = Lanes::uniform(divided(component(ray.direction, y()), dz));
    ox = Lanes::uniform(component(ray.origin, x()));
    oy = Lanes::uniform(component(ray.origin, y()));
    oz = Lanes::uniform(component(ray.origin, z));
  }
  /// The other axes, 1, 2, 0 and 2, 0, 1 for z = 0, 1, 2: from two bits each.
  HIPRT_HD HIPRT_INLINE unsigned x() const { return 0b00'10'01u >> 2 * z & 3u; }
  HIPRT_HD HIPRT_INLINE unsigned y() const { return 0b01'00'10u >> 2 * z & 3u; }
  /// By selection: indexing a vector at run time would move it to memory on a GPU.
  HIPRT_HD static HIPRT_INLINE Real component(const BasicVec3<Real>& v, unsigned axis) {
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
  }
};

/// Decides by the sheared, rounded vertices, exactly: where a sign is not certain (an edge function is zero, or may
/// have lost it to underflow) it is decided again in double precision, where products of floats are exact. So a ray
/// cannot pass between neighbours. Triangles own their edges: a ray through a shared edge meets both.
struct Watertight : ShearedTriangleTest<Watertight> {
  template <class Lanes> struct PreparedRay : ShearedRay<Lanes> {
    float dz;
    HIPRT_HD HIPRT_INLINE explicit PreparedRay(const Ray& ray)
        : ShearedRay<Lanes>(ray), dz(this->component(ray.direction, this->z)) {}
  };

  /// See ShearedTriangleTest::meet().
  template <class Lanes, class Leaf, class Accept>
  HIPRT_HD static HIPRT_INLINE bool intersect(const Leaf& leaf, const LeafInfo& info, const PreparedRay<Lanes>& ray,
                                              Accept&& accept) {
    return meet<Lanes>(leaf, info, ray, accept);
  }

 private:
  friend ShearedTriangleTest;

  template <class Lanes> HIPRT_HD static constexpr float uncertainty(const Sheared<Lanes>&, const PreparedRay<Lanes>&) {
    return kTiny;
  }

  /// @param corners by value: a reference costs five registers on AMD (clang 14).
  template <class Lanes, class Leaf>
  HIPRT_HD static HIPRT_INLINE bool finish(Corners<float> corners, const Leaf& leaf, const PreparedRay<Lanes>& ray,
                                           bool second, std::uint32_t id, Candidate& result) {
    if (!corners.are_certain() || !(absolute(corners.weight[0] + corners.weight[1] + corners.weight[2]) < 0x1p126f))
      return finish_in_double<Lanes>(read_again(leaf), ray, second, id, result);
    finish_quickly(corners, id, ray.dz, result);
    return true;
  }

  /// The same decision with exact signs for all finite sheared coordinates.
  template <class Lanes, class Leaf>
  HIPRT_HD static HIPRT_INLINE bool finish_in_double(const Leaf& leaf, const PreparedRay<Lanes>& ray, bool second,
                                                     std::uint32_t id, Candidate& result) {
    const Sheared<Lanes> at(leaf, ray);
    float x[3], y[3], z[3];
    corners_of<Lanes>(at.x, second, id, x);
    corners_of<Lanes>(at.y, second, id, y);
    corners_of<Lanes>(at.z, second, id, z);
    // Products of floats are exact in double, so each difference is rounded once.
    const auto edge = [&](int j, int k) HIPRT_INLINE_LAMBDA {
      const double product = static_cast<double>(y[j]) * static_cast<double>(x[k]);
      return fused_multiply_add(static_cast<double>(x[j]), static_cast<double>(y[k]), -product);
    };
    const double weight[3] = {edge(1, 2), edge(2, 0), edge(0, 1)};
    const bool positive = weight[0] > 0.0 || weight[1] > 0.0 || weight[2] > 0.0;
    const bool negative = weight[0] < 0.0 || weight[1] < 0.0 || weight[2] < 0.0;
    const double sum = weight[0] + weight[1] + weight[2];
    if ((positive && negative) || !(sum != 0.0)) return false;
    const double depth = fused_multiply_add(
        weight[0], static_cast<double>(z[0]),
        fused_multiply_add(weight[1], static_cast<double>(z[1]), weight[2] * static_cast<double>(z[2])));
    result.u = static_cast<float>(weight[1] / sum);
    result.v = static_cast<float>(weight[2] / sum);
    result.t = static_cast<float>(depth / sum / static_cast<double>(ray.dz));
    return true;
  }
};

/// Moeller & Trumbore 1997, in float, with whatever contraction the compiler likes: the fast end of the trade. Rays
/// leak through shared edges and vertices.
struct Fast {
  template <class Lanes> struct PreparedRay {
    Vec3 origin, direction;
    HIPRT_HD HIPRT_INLINE explicit PreparedRay(const Ray& ray) : origin(ray.origin), direction(ray.direction) {}
  };

  template <class Lanes, class Leaf, class Accept>
  HIPRT_HD static HIPRT_INLINE bool intersect(const Leaf& leaf, const LeafInfo& info, const PreparedRay<Lanes>& ray,
                                              Accept&& accept) {
    using Float = typename Lanes::Float;
    // Lanes 0 and 1 are triangles 0 and 1: corners (v0, v1, v2) and (v1, v3, v2).
    const Vec<Lanes> vertex{load_coordinates<Lanes>(leaf, 0), load_coordinates<Lanes>(leaf, 1),
                            load_coordinates<Lanes>(leaf, 2)};
    const Vec<Lanes> corner = shuffle<Lanes, 0, 1>(vertex);
    const Vec<Lanes> edge1 = sub(shuffle<Lanes, 1, 3>(vertex), corner);
    const Vec<Lanes> edge2 = sub(shuffle<Lanes, 2, 2>(vertex), corner);
    const Vec<Lanes> from = sub(all<Lanes>(ray.origin), corner), d = all<Lanes>(ray.direction);
    const Vec<Lanes> p = cross(d, edge2), q = cross(from, edge1);
    const Float one = Lanes::all(1.0f), zero = Lanes::all(0.0f);
    const Float reciprocal = Lanes::div(one, dot(edge1, p));
    const Float weight1 = Lanes::mul(dot(from, p), reciprocal), weight2 = Lanes::mul(dot(d, q), reciprocal);
    const std::uint32_t triangles = info.primitive[1] == kInvalidId ? 0b01 : 0b11;
    const std::uint32_t met = triangles & Lanes::less_equal(zero, weight1) & Lanes::less_equal(zero, weight2) &
                              Lanes::less_equal(Lanes::add(weight1, weight2), one);
    if (met == 0) return true;
    const Float distance = Lanes::mul(dot(edge2, q), reciprocal);
    for (unsigned triangle = 0; triangle < 2; ++triangle) {
      if ((met >> triangle & 1u) == 0) continue;
      const float w1 = Lanes::get(weight1, triangle), w2 = Lanes::get(weight2, triangle);
      float weight[3] = {max_of(1.0f - w1 - w2, 0.0f), w1, w2};
      to_mesh_order(weight, info.triangle_ids >> (8 * triangle));
      if (!accept(Candidate{Lanes::get(distance, triangle), weight[1], weight[2]}, triangle)) return false;
    }
    return true;
  }

 private:
  /// A vector per lane.
  template <class Lanes> struct Vec {
    typename Lanes::Float x, y, z;

    HIPRT_HD HIPRT_INLINE friend Vec sub(const Vec& a, const Vec& b) {
      return {Lanes::sub(a.x, b.x), Lanes::sub(a.y, b.y), Lanes::sub(a.z, b.z)};
    }
    HIPRT_HD HIPRT_INLINE friend Vec cross(const Vec& a, const Vec& b) {
      return {Lanes::sub(Lanes::mul(a.y, b.z), Lanes::mul(a.z, b.y)),
              Lanes::sub(Lanes::mul(a.z, b.x), Lanes::mul(a.x, b.z)),
              Lanes::sub(Lanes::mul(a.x, b.y), Lanes::mul(a.y, b.x))};
    }
    HIPRT_HD HIPRT_INLINE friend typename Lanes::Float dot(const Vec& a, const Vec& b) {
      return Lanes::madd(a.x, b.x, Lanes::madd(a.y, b.y, Lanes::mul(a.z, b.z)));
    }
  };
  template <class Lanes> HIPRT_HD static HIPRT_INLINE Vec<Lanes> all(const Vec3& a) {
    return {Lanes::all(a.x), Lanes::all(a.y), Lanes::all(a.z)};
  }
  template <class Lanes, int A, int B> HIPRT_HD static HIPRT_INLINE Vec<Lanes> shuffle(const Vec<Lanes>& a) {
    return {Lanes::template shuffle<A, B, A, B>(a.x), Lanes::template shuffle<A, B, A, B>(a.y),
            Lanes::template shuffle<A, B, A, B>(a.z)};
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
