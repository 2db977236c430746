#pragma once
/// The watertight triangle test.
///
/// From top to bottom: shear the leaf's vertices, compute the edge functions of both triangles at once, compare their
/// signs, and divide for t, u and v. sheared_space.h has the parts of these steps.

#include <hiprt_device/intersect/sheared_space.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Finds the triangles of a leaf that a line meets, from the signs of edge functions in a space where the ray is the z
/// axis (Woop, Benthin, Wald 2013).
///
/// Edge functions are differences of products after Kahan with explicit fused multiply-adds. Their sign is exact
/// unless something underflows or overflows. Every vertex is sheared in the same way in every triangle. So results do
/// not depend on how triangles are paired, rotated or laid out.
/// @tparam Test the policy. It has PreparedRay, a ShearedRay. uncertainty(sheared vertices, ray) is the largest edge
/// function whose sign may be wrong. finish() decides such cases and makes the candidate.
template <class Test> struct ShearedTriangleTest {
  /// Calls accept(candidate, triangle) for each of the leaf's triangles that the line meets, triangle 0 first. Stops
  /// when accept returns false.
  /// @return false if it was stopped.
  /// @param info the leaf's.
  template <class Lanes, class Leaf, class Ray, class Accept>
  HIPRT_HD static HIPRT_FORCE_INLINE bool meet(const Leaf& leaf, const LeafInfo& info, const Ray& ray,
                                               Accept&& accept) {
    using Float = typename Lanes::Float;
    using Real = typename Lanes::Scalar;
    const ShearedVertices<Lanes> at(leaf, ray);
    const Float around = edges_around<Lanes>(at), shared = shared_edges<Lanes>(at);
    const Real uncertainty = Test::template uncertainty<Lanes>(at, ray);
    const EdgeSigns<Lanes> signs(around, shared, uncertainty);
    const bool meets0 = signs.meets0(), meets1 = signs.meets1();
    if (!meets0 && !meets1) return true;
    const Real e0 = Lanes::get(around, 0), e1 = Lanes::get(around, 1), e2 = Lanes::get(around, 2),
               e3 = Lanes::get(around, 3), s0 = Lanes::get(shared, 0), s1 = Lanes::get(shared, 1);
    const Real z0 = Lanes::get(at.z, 0), z1 = Lanes::get(at.z, 1), z2 = Lanes::get(at.z, 2), z3 = Lanes::get(at.z, 3);
    // One loop for both triangles: the lanes of a wave test the first hit of their leaves together, whichever triangle
    // it is.
    for (bool second = !meets0, more = meets0 && meets1;; second = true, more = false) {
      const TriangleCorners<Real> corners{{choose(second, e2, s0), choose(second, s1, e3), choose(second, e1, e0)},
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

  /// A larger edge function has not lost its sign to underflow. One of its products is beyond 2^-100, so the error
  /// term of Kahan's method is exact.
  static constexpr float kTiny = 0x1p-98f;

  /// Computes in the precision of the corners.
  template <class Real>
  HIPRT_HD static HIPRT_FORCE_INLINE void finish_quickly(TriangleCorners<Real> corners, std::uint32_t id, Real dz,
                                                         BasicCandidate<Real>& result) {
    to_mesh_order(corners.weight, id);
    to_mesh_order(corners.z, id);
    interpolate(corners.weight, corners.z, dz, result);
  }
  /// @param w, z edge functions and depths in the mesh's order.
  template <class Real>
  HIPRT_HD static HIPRT_FORCE_INLINE void interpolate(const Real (&w)[3], const Real (&z)[3], Real dz,
                                                      BasicCandidate<Real>& result) {
    const Real sum = w[0] + w[1] + w[2], reciprocal = divided(Real(1), sum);
    result.u = w[1] * reciprocal;
    result.v = w[2] * reciprocal;
    const Real depth = fused_multiply_add(w[0] * reciprocal, z[0], fused_multiply_add(result.u, z[1], result.v * z[2]));
    result.t = divided(depth, dz);
    result.front = is_front(sum, dz);
  }

 private:
  /// Edge functions of v0 v1, v1 v3, v3 v2 and v2 v0, around both triangles.
  template <class Lanes>
  HIPRT_HD HIPRT_FORCE_INLINE static typename Lanes::Float edges_around(const ShearedVertices<Lanes>& at) {
    return difference_of_products<Lanes>(
        Lanes::template shuffle<0, 1, 3, 2>(at.x), Lanes::template shuffle<1, 3, 2, 0>(at.y),
        Lanes::template shuffle<0, 1, 3, 2>(at.y), Lanes::template shuffle<1, 3, 2, 0>(at.x));
  }
  /// Lanes 0 and 1: the shared edge v1 v2, and back.
  template <class Lanes>
  HIPRT_HD HIPRT_FORCE_INLINE static typename Lanes::Float shared_edges(const ShearedVertices<Lanes>& at) {
    return difference_of_products<Lanes>(
        Lanes::template shuffle<1, 2, 1, 2>(at.x), Lanes::template shuffle<2, 1, 2, 1>(at.y),
        Lanes::template shuffle<1, 2, 1, 2>(at.y), Lanes::template shuffle<2, 1, 2, 1>(at.x));
  }

 protected:
  /// The triangle's corners in the mesh's order.
  /// @param of a value per vertex of the leaf.
  template <class Lanes>
  HIPRT_HD static HIPRT_FORCE_INLINE void corners_of(const typename Lanes::Float& of, bool second, std::uint32_t id,
                                                     typename Lanes::Scalar (&corner)[3]) {
    const typename Lanes::Scalar v0 = Lanes::get(of, 0), v1 = Lanes::get(of, 1), v2 = Lanes::get(of, 2),
                                 v3 = Lanes::get(of, 3);
    corner[0] = choose(second, v1, v0);
    corner[1] = choose(second, v3, v1);
    corner[2] = v2;
    to_mesh_order(corner, id);
  }
};

/// Decides exactly by the sheared, rounded vertices. So a ray cannot pass between neighbours.
///
/// A sign is not certain if an edge function is zero or may have underflowed. Such a sign is computed again in double
/// precision, where products of floats are exact. Triangles own their edges: a ray through a shared edge meets both.
struct Watertight : ShearedTriangleTest<Watertight> {
  template <class Lanes> struct PreparedRay : ShearedRay<Lanes> {
    float dz;
    HIPRT_HD HIPRT_FORCE_INLINE explicit PreparedRay(const Ray& ray)
        : ShearedRay<Lanes>(ray), dz(this->component(ray.direction, this->z)) {}
  };

  /// See ShearedTriangleTest::meet().
  template <class Lanes, class Leaf, class Accept>
  HIPRT_HD static HIPRT_FORCE_INLINE bool intersect(const Leaf& leaf, const LeafInfo& info,
                                                    const PreparedRay<Lanes>& ray, Accept&& accept) {
    return meet<Lanes>(leaf, info, ray, accept);
  }

 private:
  friend ShearedTriangleTest;

  template <class Lanes>
  HIPRT_HD static constexpr float uncertainty(const ShearedVertices<Lanes>&, const PreparedRay<Lanes>&) {
    return kTiny;
  }

  /// @param corners by value: a reference costs five registers on AMD (clang 14).
  template <class Lanes, class Leaf>
  HIPRT_HD static HIPRT_FORCE_INLINE bool finish(TriangleCorners<float> corners, const Leaf& leaf,
                                                 const PreparedRay<Lanes>& ray, bool second, std::uint32_t id,
                                                 Candidate& result) {
    if (!corners.are_certain() || !(absolute(corners.weight[0] + corners.weight[1] + corners.weight[2]) < 0x1p126f))
      return finish_in_double<Lanes>(read_again(leaf), ray, second, id, result);
    finish_quickly(corners, id, ray.dz, result);
    return true;
  }

  /// The same decision with exact signs for all finite sheared coordinates.
  template <class Lanes, class Leaf>
  HIPRT_HD static HIPRT_FORCE_INLINE bool finish_in_double(const Leaf& leaf, const PreparedRay<Lanes>& ray, bool second,
                                                           std::uint32_t id, Candidate& result) {
    const ShearedVertices<Lanes> at(leaf, ray);
    float x[3], y[3], z[3];
    corners_of<Lanes>(at.x, second, id, x);
    corners_of<Lanes>(at.y, second, id, y);
    corners_of<Lanes>(at.z, second, id, z);
    // Products of floats are exact in double, so each difference is rounded once.
    const auto edge = [&](int j, int k) HIPRT_FORCE_INLINE_LAMBDA {
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
    result.front = is_front(sum, static_cast<double>(ray.dz));
    return true;
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
