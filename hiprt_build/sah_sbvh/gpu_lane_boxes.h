#pragma once
/// References and boxes in the lanes of a group: loads, prefix sums of boxes, and the cheapest of the lanes' splits.
/// Internal.
///
/// Long loops here and in the kernels that include this header are not unrolled. The instruction caches hold only
/// small kernels, and waves wait for instructions otherwise (decision 0013).

#include <hiprt_build/exec/gpu_scan.h>
#include <hiprt_build/input/leaf.h>
#include <hiprt_build/pipeline/gpu_state.h>

namespace hiprt::build::kernels {

/// A reference by two loads of 16 bytes, whatever becomes of its parts.
inline __device__ Reference load(const Reference* from) {
  const uint4 a = reinterpret_cast<const uint4*>(from)[0], b = reinterpret_cast<const uint4*>(from)[1];
  const auto number = [](std::uint32_t bits) { return std::bit_cast<float>(bits); };
  return Reference{
      {{number(a.x), number(a.y), number(a.z)}, {number(a.w), number(b.x), number(b.y)}}, LeafContents{b.z}, b.w};
}

inline __device__ float from_lane(const WaveGroup& group, unsigned lane, float value) {
  return std::bit_cast<float>(group.from(lane, std::bit_cast<std::uint32_t>(value)));
}
inline __device__ Box from_lane(const WaveGroup& group, unsigned lane, const Box& box) {
  Box result;
  for (unsigned k = 0; k < 3; ++k) {
    result.min[k] = from_lane(group, lane, box.min[k]);
    result.max[k] = from_lane(group, lane, box.max[k]);
  }
  return result;
}
/// grow() in fewer instructions. @pre no NaN.
inline __device__ void grow_fast(Box& box, const Box& other) {
  for (unsigned k = 0; k < 3; ++k) {
    box.min[k] = fminf(box.min[k], other.min[k]);
    box.max[k] = fmaxf(box.max[k], other.max[k]);
  }
}
/// The sum of all lanes' boxes.
inline __device__ Box unite_lanes(const WaveGroup& group, Box box) {
#pragma unroll 1
  for (unsigned step = 1; step < WaveGroup::kLanes; step *= 2)
    grow_fast(box, from_lane(group, group.lane() ^ step, box));
  return box;
}
/// The sum over this lane and those before it, down to @p first, of up to 1 << steps lanes.
inline __device__ void sum_up(const WaveGroup& group, Box& box, unsigned first, unsigned steps) {
#pragma unroll 1
  for (unsigned k = 0; k < steps; ++k) {
    const unsigned distance = 1u << k;
    const bool inside = group.lane() >= first + distance;
    const Box other = from_lane(group, inside ? group.lane() - distance : group.lane(), box);
    if (inside) grow_fast(box, other);
  }
}
/// The same over this lane and those behind it, as far as before @p last.
inline __device__ void sum_down(const WaveGroup& group, Box& box, unsigned last, unsigned steps) {
#pragma unroll 1
  for (unsigned k = 0; k < steps; ++k) {
    const unsigned distance = 1u << k;
    const bool inside = group.lane() + distance < last;
    const Box other = from_lane(group, inside ? group.lane() + distance : group.lane(), box);
    if (inside) grow_fast(box, other);
  }
}
inline __device__ std::uint32_t sum_down(const WaveGroup& group, std::uint32_t value, unsigned last) {
  for (unsigned distance = 1; distance < last; distance *= 2) {
    const bool inside = group.lane() + distance < last;
    const std::uint32_t other = group.from(inside ? group.lane() + distance : group.lane(), value);
    value += inside ? other : 0;
  }
  return value;
}

inline __device__ bool holds_nothing(const Box& box) { return !(box.min[0] <= box.max[0]); }
inline __device__ float side_cost(const Box& box, std::uint32_t count) {
  return holds_nothing(box) ? 0.0f : half_area(box) * static_cast<float>(count);
}
/// Half the area of what two boxes have in common.
inline __device__ float overlap_area(const Box& a, const Box& b) {
  float edge[3];
  bool common = true;
  for (unsigned k = 0; k < 3; ++k) {
    edge[k] = fminf(a.max[k], b.max[k]) - fmaxf(a.min[k], b.min[k]);
    common = common && edge[k] >= 0.0f;
  }
  return common ? half_area(edge[0], edge[1], edge[2]) : 0.0f;
}
/// Component @p axis, without an array in memory.
inline __device__ float pick(const float (&v)[3], unsigned axis) { return axis == 0 ? v[0] : axis == 1 ? v[1] : v[2]; }

/// The lane with the lowest cost; of two with the same the one with the lower tie.
struct LaneChoice {
  std::uint32_t cost;  ///< A float's bits; kNone: no lane has a finite one.
  std::uint32_t tie;

  static constexpr std::uint32_t kNone = 0xffffffffu;

  __device__ LaneChoice(float value, std::uint32_t tie_)
      : cost(value < SimdBox::kInfinity ? std::bit_cast<std::uint32_t>(value) : kNone), tie(tie_) {}
  __device__ void add(const LaneChoice& other, bool valid) {
    const bool better = valid && (other.cost < cost || (other.cost == cost && other.tie < tie));
    cost = better ? other.cost : cost;
    tie = better ? other.tie : tie;
  }
  __device__ LaneChoice from(const WaveGroup& group, unsigned lane) const {
    LaneChoice result = *this;
    result.cost = group.from(lane, cost);
    result.tie = group.from(lane, tie);
    return result;
  }
  __device__ bool exists() const { return cost != kNone; }
  __device__ float value() const { return exists() ? std::bit_cast<float>(cost) : SimdBox::kInfinity; }
};
inline __device__ LaneChoice best_of_lanes(const WaveGroup& group, LaneChoice mine) {
  for (unsigned step = 1; step < WaveGroup::kLanes; step *= 2) mine.add(mine.from(group, group.lane() ^ step), true);
  return mine;
}

}  // namespace hiprt::build::kernels
