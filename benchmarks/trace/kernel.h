#pragma once
/// Traces batches of rays with policies that are selected at run time, by the machine's best instruction set. The
/// traversal is compiled once per instruction set (kernel_variants.cpp).
///
/// Jobs have plain members only. A container's inline functions would be compiled for a newer instruction set, and the
/// linker could keep that copy for the whole program.

#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::bench {

enum class Tests {
  kAccurate,   ///< Watertight triangles and Conservative boxes, the defaults.
  kFast,       ///< Fast triangles and Plain boxes.
  kReference,  ///< Reference triangles and Conservative boxes. For NodeLayout::kPlanes and Lanes::kDefault.
};

enum class Lanes {
  kDefault,  ///< The host's vector registers.
  kHost,     ///< closest_hit(scene, ray) and any_hit(scene, ray): the tracer that the library has compiled.
  kMany,     ///< closest_hits() and any_hits(), which choose how rays are traced together.
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
  Hit* hits;  ///< One per ray.
  std::size_t count;
  Work* work;  ///< nullptr: the work is not counted. Lanes::kDefault only.
};

/// Traces rays[i] into hits[i] on the calling thread.
void run_kernel(const KernelJob& job);

}  // namespace hiprt::bench
