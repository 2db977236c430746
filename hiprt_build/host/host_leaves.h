#pragma once
/// The watertight test of the four triangles of two leaves at once. Internal; for sources compiled with AVX2 and FMA.
///
/// The operations are those of ShearedTriangleTest and Watertight (intersect/watertight.h), with the same roundings per
/// triangle. So decisions, t, u and v are the same bits.

#include <hiprt_build/host/host_ray.h>
#include <hiprt_build/host/wide_lanes.h>
#include <hiprt_device/intersect/watertight.h>

#include <array>
#include <bit>

namespace hiprt::format_detail {
inline namespace HIPRT_ISA_NAMESPACE {

namespace host_leaves_detail {

/// A triangle's corners in the mesh's order: where meet_leaves() keeps the edge functions of a first leaf, and the
/// leaf's vertices. So no branch depends on how a triangle is stored.
struct CornerPlaces {
  std::uint8_t weight[4];  ///< The fourth is not used.
  std::uint8_t vertex[4];  ///< Of the leaf; the fourth is the first.
};
/// @param triangle_id TriangleId, four bits.
constexpr CornerPlaces corner_places(bool second, std::uint32_t triangle_id) {
  // Of the stored corners: the edges around the leaf are 0 to 3, the shared edge and back 8 and 9.
  std::uint8_t weight[3] = {8, 3, 0}, vertex[3] = {0, 1, 2};
  if (second) {
    weight[0] = 2, weight[1] = 9, weight[2] = 1;
    vertex[0] = 1, vertex[1] = 3;
  }
  to_mesh_order(weight, triangle_id);
  to_mesh_order(vertex, triangle_id);
  return {{weight[0], weight[1], weight[2], 0}, {vertex[0], vertex[1], vertex[2], vertex[0]}};
}
inline constexpr auto kCornerPlaces = [] {
  std::array<CornerPlaces, 32> places{};
  for (unsigned i = 0; i < 32; ++i) places[i] = corner_places(i >= 16, i & 15u);
  return places;
}();

}  // namespace host_leaves_detail

/// A leaf of the file, and a triangle of it.
struct HostTriangle {
  const PlanesLeaf* leaf = nullptr;
  unsigned triangle = 0;

  std::uint32_t geometry() const { return leaf->info.geometry_and_flags & kGeometryMask; }
  std::uint32_t primitive() const { return leaf->info.primitive[triangle]; }
  HIPRT_FORCE_INLINE const host_leaves_detail::CornerPlaces& places() const {
    return host_leaves_detail::kCornerPlaces[16 * triangle + (leaf->info.triangle_ids >> 8 * triangle & 15u)];
  }
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
  /// The three edge functions of triangle i of leaf h, in lane 4 h + i: those around the leaf are 0 and 3, 1 and 2. The
  /// other lanes are not used.
  HIPRT_FORCE_INLINE WideLanes::Float other() const { return WideLanes::shuffle<3, 2, 2, 3>(around); }

  /// Bit 4 h + i: triangle i of leaf h may be hit. No edge function is certainly positive, or none certainly negative.
  /// And the depth of the hit is not certainly less than that of tmin: the line of a short ray meets many triangles
  /// behind its origin. A NaN counts as neither, or hides others: then the triangle is met, and meet_again() decides.
  ///
  /// With u = 2^-24: the depth t dz is n / d, n the sum of edge functions times depths, d the sum of edge functions.
  /// The edge functions of a triangle that is met have one sign. So n / d is off by at most 8 u times the largest depth
  /// of a vertex, here and in Watertight. Near n / d the product of tmin and dz is off by 2 u. 32 u are allowed.
  /// HostRay::slack covers what edge functions of up to kTiny, whose signs are not certain, add to n, and underflow.
  /// Below 2^40 units of reach nothing overflows: an edge function is at most 8 reach^2. Beyond, slack is infinite.
  HIPRT_FORCE_INLINE std::uint32_t triangles_met(const HostRay& ray) const {
    using Lanes = WideLanes;
    const auto third = other();
    const auto most = Lanes::max(Lanes::max(around, third), shared);
    const auto least = Lanes::min(Lanes::min(around, third), shared);
    const auto mixed = Lanes::both(Lanes::lanes_greater(most, Lanes::all(Watertight::kTiny)),
                                   Lanes::lanes_greater(Lanes::all(-Watertight::kTiny), least));

    const auto n =
        Lanes::fma(around, Lanes::shuffle<2, 2, 2, 2>(z),
                   Lanes::fma(third, Lanes::shuffle<1, 1, 1, 1>(z), Lanes::mul(shared, Lanes::shuffle<0, 3, 0, 3>(z))));
    const auto d = Lanes::add(Lanes::add(around, third), shared);
    // Times |dz| / dz.
    const auto depth = Lanes::flip_sign(n, Lanes::exclusive_or(d, Lanes::all(ray.dz)));
    const auto away = Lanes::magnitude(z), farther = Lanes::max(away, Lanes::shuffle<2, 3, 0, 1>(away));
    const auto margin = Lanes::mul(Lanes::max(farther, Lanes::shuffle<1, 0, 3, 2>(farther)), Lanes::all(0x1p-19f));
    const auto behind = Lanes::lanes_greater(
        Lanes::fma(Lanes::magnitude(d), Lanes::sub(Lanes::all(ray.least_depth), margin), Lanes::all(-ray.slack)),
        depth);
    return Lanes::bits_of(Lanes::either(mixed, behind)) ^ 0xffu;
  }
  /// The triangles that floats decide: all signs are certain, and no sum overflows. A NaN is not certain.
  HIPRT_FORCE_INLINE std::uint32_t triangles_quick() const {
    using Lanes = WideLanes;
    const auto a = Lanes::magnitude(around), b = Lanes::magnitude(other()), c = Lanes::magnitude(shared);
    const auto certain = [&](Lanes::Float of) {
      return Lanes::greater(of, Lanes::all(Watertight::kTiny)) & Lanes::greater(Lanes::all(0x1p124f), of);
    };
    return certain(a) & certain(b) & certain(c);
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
  std::uint32_t met = edges.triangles_met(prepared) & (count == 1 ? 0x3u : 0x33u);
  if (met == 0) return true;
  const std::uint32_t quick = edges.triangles_quick();
  alignas(32) float weight_at[16], depth_at[8];
  WideLanes::store(weight_at, edges.around);
  WideLanes::store(weight_at + 8, edges.shared);
  WideLanes::store(depth_at, edges.z);
  do {
    const unsigned bit = static_cast<unsigned>(std::countr_zero(met)), half = bit >> 2, second = bit & 1u;
    met &= met - 1;
    const HostTriangle triangle{leaves + half, second};
    const CornerPlaces& places = triangle.places();
    const float *const w = weight_at + 4 * half, *const z = depth_at + 4 * half;
    const float weight[3] = {w[places.weight[0]], w[places.weight[1]], w[places.weight[2]]};
    const float depth[3] = {z[places.vertex[0]], z[places.vertex[1]], z[places.vertex[2]]};
    Candidate candidate;
    if ((quick >> bit & 1u) != 0) [[likely]]
      Watertight::interpolate(weight, depth, prepared.dz, candidate);
    else if (!meet_again(ray, triangle, candidate))
      continue;
    if (!accept(candidate, triangle)) return false;
  } while (met != 0);
  return true;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::format_detail
