#pragma once
/// Batches of rays through the traversal of hiprt_device, with the policies that are compared chosen at run time and
/// the machine's best instruction set. The traversal is compiled once per instruction set (kernel_variants.cpp).
///
/// Plain members only: a container's inline function, compiled for a newer instruction set, could be the copy that the
/// linker keeps for the whole program.

#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::bench {

enum class Tests {
  kAccurate,  ///< Watertight triangles and Conservative boxes, the defaults.
  kFast,      ///< Fast triangles and Plain boxes.
};

enum class Lanes {
  kDefault,  ///< The host's vector registers.
  kArray,    ///< Plain C++. Compiled for NodeLayout::kPlanes and Tests::kAccurate only.
};

/// Work of all rays together.
struct Work {
  std::uint64_t box_tests = 0;   ///< Four-box tests.
  std::uint64_t leaf_tests = 0;  ///< Tests of a leaf (one or two triangles).
};

struct KernelJob {
  const SceneView* scene;
  bool any_hit;
  Tests tests;
  Lanes lanes;
  const Ray* rays;
  Hit* hits;  ///< As many as rays.
  std::size_t count;
  Work* work;  ///< nullptr: the work is not counted. Lanes::kDefault only.
};

/// Traces rays[i] into hits[i] on the calling thread.
void run_kernel(const KernelJob& job);

}  // namespace hiprt::bench
