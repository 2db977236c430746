#pragma once
/// The watertight test of the four triangles of two leaves at once. Internal; for sources compiled with AVX2 and FMA.
///
/// The operations are those of ShearedTriangleTest and Watertight (intersect/watertight.h), with the same roundings per
/// triangle. So decisions, t, u and v are the same bits.

#include <hiprt_build/host/host_ray.h>
#include <hiprt_device/intersect/watertight.h>

#include <bit>

namespace hiprt::format_detail {
inline namespace HIPRT_ISA_NAMESPACE {

/// A leaf of the file, and a triangle of it.
struct HostTriangle {
  const PlanesLeaf* leaf = nullptr;
  unsigned triangle = 0;

  std::uint32_t geometry() const { return leaf->info.geometry_and_flags & kGeometryMask; }
  std::uint32_t primitive() const { return leaf->info.primitive[triangle]; }
};

namespace host_leaves_detail {

/// The general test of one triangle, where floats do not decide.
[[gnu::noinline, gnu::cold]] inline bool meet_again(const Ray& ray, const HostTriangle& of, Candidate& result) {
  bool met = false;
  Watertight::intersect<SimdLanes>(*of.leaf, of.leaf->info, Watertight::PreparedRay<SimdLanes>(ray),
                                   [&](const Candidate& at, unsigned triangle) {
                                     if (triangle == of.triangle) {
                                       result = at;
                                       met = true;
                                     }
                                     return true;
                                   });
  return met;
}

/// Edge functions around both triangles of each leaf, those of the shared edge and back, and depths.
struct LeafEdges {
  WideLanes::Float around, shared, z;

  HIPRT_FORCE_INLINE LeafEdges(const PlanesLeaf* first, const PlanesLeaf* second, const HostRay& ray) {
    using Lanes = WideLanes;
    const auto from = [&](unsigned k) {
      const auto row = [&](const PlanesLeaf* leaf) {
        return reinterpret_cast<const float*>(reinterpret_cast<const char*>(leaf) + ray.row[k]);
      };
      return Lanes::sub(Lanes::load_halves(row(first), row(second)), Lanes::all(ray.origin[k]));
    };
    z = from(2);
    const auto x = Lanes::fnma(Lanes::all(ray.shear[0]), z, from(0));
    const auto y = Lanes::fnma(Lanes::all(ray.shear[1]), z, from(1));
    around = difference_of_products<Lanes>(Lanes::shuffle<0, 1, 3, 2>(x), Lanes::shuffle<1, 3, 2, 0>(y),
                                           Lanes::shuffle<0, 1, 3, 2>(y), Lanes::shuffle<1, 3, 2, 0>(x));
    shared = difference_of_products<Lanes>(Lanes::shuffle<1, 2, 1, 2>(x), Lanes::shuffle<2, 1, 2, 1>(y),
                                           Lanes::shuffle<1, 2, 1, 2>(y), Lanes::shuffle<2, 1, 2, 1>(x));
  }
  /// Bit 4 h + i: no edge function of triangle i of leaf h is certainly positive, or none certainly negative.
  HIPRT_FORCE_INLINE std::uint32_t triangles_met() const {
    using Lanes = WideLanes;
    const auto least = Lanes::all(Watertight::kTiny), most = Lanes::all(-Watertight::kTiny);
    const std::uint32_t positive = Lanes::greater(around, least), shared_positive = Lanes::greater(shared, least);
    const std::uint32_t negative = Lanes::greater(most, around), shared_negative = Lanes::greater(most, shared);
    // Triangle 0 has edges 0 and 3 around, and shared edge 0; triangle 1 has edges 1 and 2, and shared edge 1.
    const std::uint32_t both0 =
        (positive | positive >> 3 | shared_positive) & (negative | negative >> 3 | shared_negative);
    const std::uint32_t both1 =
        (positive >> 1 | positive >> 2 | shared_positive >> 1) & (negative >> 1 | negative >> 2 | shared_negative >> 1);
    return (~both0 & 0x11u) | (~both1 & 0x11u) << 1;
  }
};

}  // namespace host_leaves_detail

/// Calls accept(candidate, triangle) for each triangle that the ray's line meets. Stops when accept returns false.
/// @param count leaves side by side, 1 or 2.
/// @return false if it was stopped.
template <class Accept>
HIPRT_FORCE_INLINE bool meet_leaves(const PlanesLeaf* leaves, unsigned count, const Ray& ray, const HostRay& prepared,
                                    Accept&& accept) {
  using namespace host_leaves_detail;
  const LeafEdges edges(leaves, leaves + (count - 1), prepared);
  std::uint32_t met = edges.triangles_met() & (count == 1 ? 0xfu : 0xffu);
  if (met == 0) return true;
  alignas(32) float around[8], shared[8], depth[8];
  WideLanes::store(around, edges.around);
  WideLanes::store(shared, edges.shared);
  WideLanes::store(depth, edges.z);
  do {
    const unsigned bit = static_cast<unsigned>(std::countr_zero(met)), half = bit >> 2;
    met &= met - 1;
    const bool second = (bit & 1u) != 0;
    const float *const e = around + 4 * half, *const s = shared + 4 * half, *const z = depth + 4 * half;
    const TriangleCorners<float> corners{{second ? e[2] : s[0], second ? s[1] : e[3], second ? e[1] : e[0]},
                                         {second ? z[1] : z[0], second ? z[3] : z[1], z[2]},
                                         Watertight::kTiny};
    const HostTriangle triangle{leaves + half, bit & 1u};
    Candidate candidate;
    if (Watertight::is_quick(corners)) [[likely]]
      Watertight::finish_quickly(corners, triangle.leaf->info.triangle_ids >> (second ? 8 : 0), prepared.dz, candidate);
    else if (!meet_again(ray, triangle, candidate))
      continue;
    if (!accept(candidate, triangle)) return false;
  } while (met != 0);
  return true;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::format_detail
