#pragma once
/// The result that every variant writes for a ray. Results are compared bit by bit.

#include <hiprt_device/ray.h>

#include <bit>
#include <cstdint>

namespace hiprt::bench {

/// ClosestHit, AnyHit, AllHits.
enum class Query { kClosest, kAny, kAll };

/// 8 bytes per ray, as the kernels of the other libraries write (benchmarks/peers).
struct RayResult {
  float t;           ///< Hit::t. For any hits it belongs to a hit that depends on the tree. All hits: their number.
  std::uint32_t id;  ///< Geometry and primitive in one number; kInvalidId: a miss. All hits: see HitSum.
};
static_assert(sizeof(RayResult) == 8);

/// The bits of RayResult::id that do not depend on distances, for Query::kAll.
inline constexpr std::uint32_t kPrimitiveBits = 0xffff0000u;

inline namespace HIPRT_ISA_NAMESPACE {

/// Time of ray i in [0, 1). Neighbours have different times, as in motion blur.
HIPRT_HD HIPRT_FORCE_INLINE float ray_time(std::uint32_t i) {
  return static_cast<float>(i * 0x9e3779b1u >> 8) * 0x1p-24f;
}

HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t id_of(const Hit& hit) { return hit.primitive + hit.geometry * 0x9e3779b1u; }

HIPRT_HD HIPRT_FORCE_INLINE RayResult make_result(const Hit& hit) {
  return {hit.t, hit.found() ? id_of(hit) : kInvalidId};
}

/// All hits of a ray as one result, which does not depend on their order. It has their number, 16 bits of a hash of the
/// primitives, and 16 bits of a hash of primitives and distances.
class HitSum {
 public:
  HIPRT_HD HIPRT_FORCE_INLINE void add(const Hit& hit) {
    const std::uint32_t primitive = mix(id_of(hit));
    ++count_;
    primitives_ += primitive;
    distances_ += mix(primitive ^ std::bit_cast<std::uint32_t>(hit.t));
  }
  /// @param last the query's last return value: a miss, or a failure.
  HIPRT_HD HIPRT_FORCE_INLINE RayResult result(const Hit& last) const {
    if (last.failed()) return {last.t, kInvalidId};
    return {static_cast<float>(count_), (primitives_ & kPrimitiveBits) | distances_ >> 16};
  }

 private:
  /// The finaliser of MurmurHash3: every bit of the input changes half of the output.
  HIPRT_HD static HIPRT_FORCE_INLINE std::uint32_t mix(std::uint32_t v) {
    v = (v ^ v >> 16) * 0x85ebca6bu;
    v = (v ^ v >> 13) * 0xc2b2ae35u;
    return v ^ v >> 16;
  }

  std::uint32_t count_ = 0, primitives_ = 0, distances_ = 0;
};

/// @param query an AllHits that has returned no hit yet.
template <class AllHitsQuery> HIPRT_HD HIPRT_FORCE_INLINE RayResult sum_of_hits(AllHitsQuery& query) {
  HitSum sum;
  for (;;) {
    const Hit hit = query.next_hit();
    if (!hit.found()) return sum.result(hit);
    sum.add(hit);
  }
}

}  // namespace HIPRT_ISA_NAMESPACE

/// Whether the traversal failed because its stack was too small. @return false for results that were never written
/// (kPoison).
inline bool failed(const RayResult& result) { return result.t != result.t; }

/// Every byte of the results before a launch. As a float it is a number: a missing result counts as wrong, not as
/// failed.
inline constexpr unsigned char kPoison = 0xee;

}  // namespace hiprt::bench
