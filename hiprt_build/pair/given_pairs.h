#pragma once
/// Pairs of triangles that the caller gives, on the device. Internal.

#include <hiprt_build/input.h>
#include <hiprt_build/input/leaf.h>
#include <hiprt_build/pipeline/gpu_state.h>
#include <hiprt_device/math/atomic.h>

namespace hiprt::build {

/// The pairs of one mesh. Of several pairs with a triangle the first counts.
struct GivenPairs {
  GeometryView mesh;
  std::uint32_t first;  ///< Number of the mesh's first triangle among all primitives.
  const TrianglePair* pairs;
  std::uint32_t count;
  std::uint32_t* claims;  ///< Per triangle of the mesh: the number of its pair; kInvalidId: none.

  HIPRT_HD bool can_share(std::uint32_t i) const {
    const std::uint32_t a = pairs[i][0], b = pairs[i][1], distance = a < b ? b - a : a - b;
    return a < mesh.primitive_count && b < mesh.primitive_count && a != b && distance <= LeafContents::kMaxDistance;
  }

  HIPRT_HD void claim(std::uint32_t i) const {
    if (!can_share(i)) return;
    lower(&claims[pairs[i][0]], i);
    lower(&claims[pairs[i][1]], i);
  }

  /// @return whether the two triangles now share a leaf: the reference of the lower one.
  HIPRT_HD bool join(std::uint32_t i, Reference* references) const {
    if (!can_share(i) || claims[pairs[i][0]] != i || claims[pairs[i][1]] != i) return false;
    const std::uint32_t a = pairs[i][0] < pairs[i][1] ? pairs[i][0] : pairs[i][1], b = pairs[i][0] + pairs[i][1] - a;
    Reference &lower_one = references[first + a], &upper = references[first + b];
    if (!lower_one.contents.exists() || !upper.contents.exists()) return false;
    for (unsigned edge = 0; edge < 9; ++edge) {
      const unsigned k = edge / 3, n = edge % 3;
      if (!same_position(mesh.corner(a, k), mesh.corner(b, (n + 1) % 3)) ||
          !same_position(mesh.corner(a, (k + 1) % 3), mesh.corner(b, n)))
        continue;
      lower_one.contents = LeafContents::make(b - a, (k + 2) % 3, (n + 1) % 3);
      lower_one.box = unite(lower_one.box, upper.box);
      upper.contents = LeafContents::none();
      return true;
    }
    return false;
  }
};

namespace kernels {

static __global__ void __launch_bounds__(kBlock) claim_pairs(GivenPairs pairs) {
  const std::uint32_t i = thread_index();
  if (i < pairs.count) pairs.claim(i);
}

static __global__ void __launch_bounds__(kBlock)
    join_pairs(GivenPairs pairs, Reference* references, BuildState* state) {
  const std::uint32_t i = thread_index();
  if (i >= pairs.count || !pairs.join(i, references)) return;
  fetch_add(&state->counts.pairs, 1);
  fetch_add(&state->counts.leaves, ~std::uint32_t{0});
}

}  // namespace kernels
}  // namespace hiprt::build
