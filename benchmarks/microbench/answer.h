#pragma once
/// What every variant writes for a ray, so that all can be compared bit by bit.

#include <hiprt_device/ray.h>

#include <bit>
#include <cstdint>

namespace hiprt::bench {

/// What a ray is asked: ClosestHit, AnyHit, AllHits.
enum class Query { kClosest, kAny, kAll };

/// 8 bytes per ray: what the peers' kernels write too.
struct Answer {
  float t;           ///< Hit::t. Any hit: which of the hits it belongs to depends on the tree. All hits: their number.
  std::uint32_t id;  ///< Geometry and primitive in one number; kInvalidId: a miss. All hits: see HitSum.
};
static_assert(sizeof(Answer) == 8);

/// The bits of Answer::id that do not depend on distances, for Query::kAll.
inline constexpr std::uint32_t kPrimitiveBits = 0xffff0000u;

inline namespace HIPRT_ISA_NAMESPACE {

/// When ray i of a set is traced, in scenes that move: in [0, 1), neighbours at different times, as motion blur has it.
HIPRT_HD HIPRT_INLINE float ray_time(std::uint32_t i) { return static_cast<float>(i * 0x9e3779b1u >> 8) * 0x1p-24f; }

HIPRT_HD HIPRT_INLINE std::uint32_t id_of(const Hit& hit) { return hit.primitive + hit.geometry * 0x9e3779b1u; }

HIPRT_HD HIPRT_INLINE Answer make_answer(const Hit& hit) { return {hit.t, hit.found() ? id_of(hit) : kInvalidId}; }

/// All hits of a ray as one answer, in whatever order they come: their number, 16 bits of all primitives and 16 bits of
/// all primitives with their distances.
class HitSum {
 public:
  HIPRT_HD HIPRT_INLINE void add(const Hit& hit) {
    const std::uint32_t primitive = mix(id_of(hit));
    ++count_;
    primitives_ += primitive;
    distances_ += mix(primitive ^ std::bit_cast<std::uint32_t>(hit.t));
  }
  /// @param last what came instead of one more hit: a miss, or a failure.
  HIPRT_HD HIPRT_INLINE Answer answer(const Hit& last) const {
    if (last.failed()) return {last.t, kInvalidId};
    return {static_cast<float>(count_), (primitives_ & kPrimitiveBits) | distances_ >> 16};
  }

 private:
  /// The finaliser of MurmurHash3: every bit of the input changes half of the output.
  HIPRT_HD static HIPRT_INLINE std::uint32_t mix(std::uint32_t v) {
    v = (v ^ v >> 16) * 0x85ebca6bu;
    v = (v ^ v >> 13) * 0xc2b2ae35u;
    return v ^ v >> 16;
  }

  std::uint32_t count_ = 0, primitives_ = 0, distances_ = 0;
};

/// @param query an AllHits that was not asked yet.
template <class AllHitsQuery> HIPRT_HD HIPRT_INLINE Answer sum_of_hits(AllHitsQuery& query) {
  HitSum sum;
  for (;;) {
    const Hit hit = query.next_hit();
    if (!hit.found()) return sum.answer(hit);
    sum.add(hit);
  }
}

}  // namespace HIPRT_ISA_NAMESPACE

/// Whether the traversal says that it could not tell (a stack that was too small). @return false for what was never
/// written, see kPoison.
inline bool failed(const Answer& answer) { return answer.t != answer.t; }

/// Every byte of the answers before a launch; as a float it is a number, so that a ray without answer is no failure
/// but a wrong answer.
inline constexpr unsigned char kPoison = 0xee;

}  // namespace hiprt::bench
