#pragma once
/// The engine and the boxes that tests of single build steps use.

#include <hiprt_build/exec/cpu.h>
#include <tests/oracle/random.h>

#include <algorithm>
#include <cmath>

namespace hiprt::build {

struct Machine {
  ProgressCallback none;
  Monitor monitor{none};
  MemoryLedger ledger;
  CpuEngine engine{monitor, ledger};
};

/// Leaves of a linked tree.
struct BoxLeaves {
  const Box* boxes;
  Box box(std::uint32_t leaf) const { return boxes[leaf]; }
  FastBox fast_box(std::uint32_t leaf) const { return FastBox{to_simd(boxes[leaf])}; }
};

inline Box box_at(const Position& low, const Position& size) {
  return Box{{low[0], low[1], low[2]}, {low[0] + size[0], low[1] + size[1], low[2] + size[2]}};
}

inline bool same(const Box& a, const Box& b) {
  return std::equal(a.min, a.min + 3, b.min) && std::equal(a.max, a.max + 3, b.max);
}

/// In [-1, 1]^3 or a little beyond, of very different sizes.
inline Box random_box(oracle::Random& random) {
  const Position size = random.in_cube(random.log_uniform(1e-3, 1));
  return box_at(random.in_cube(1), {std::abs(size[0]), std::abs(size[1]), std::abs(size[2])});
}

}  // namespace hiprt::build
