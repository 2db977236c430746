#pragma once
/// What every variant writes for a ray, so that all can be compared bit by bit.

#include <hiprt_device/ray.h>

#include <bit>
#include <cstdint>

namespace hiprt::bench {

/// 8 bytes per ray: what the peers' kernels write too.
struct Answer {
  float t;           ///< Hit::t. Any hit: which of the hits it belongs to depends on the tree.
  std::uint32_t id;  ///< Geometry and primitive in one number; kInvalidId: a miss.
};
static_assert(sizeof(Answer) == 8);

inline namespace HIPRT_ISA_NAMESPACE {

HIPRT_HD HIPRT_INLINE Answer make_answer(const Hit& hit) {
  return {hit.t, hit.found() ? hit.primitive + hit.geometry * 0x9e3779b1u : kInvalidId};
}

}  // namespace HIPRT_ISA_NAMESPACE

/// Whether the traversal says that it could not tell (a stack that was too small). @return false for what was never
/// written, see kPoison.
inline bool failed(const Answer& answer) { return answer.t != answer.t; }

/// Every byte of the answers before a launch; as a float it is a number, so that a ray without answer is no failure
/// but a wrong answer.
inline constexpr unsigned char kPoison = 0xee;

}  // namespace hiprt::bench
