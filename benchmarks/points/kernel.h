#pragma once
/// Asks point queries by the machine's best instruction set, or by the least one. They are compiled once per
/// instruction set (kernel_variants.cpp). Jobs have plain members only, as those of trace/kernel.h.

#include <hiprt_device/math/vec.h>
#include <hiprt_device/scene_view.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::bench {

struct PointJob {
  const SceneView* scene;
  const Vec3* points;
  double* results;  ///< One per point.
  std::size_t count;
  float reach;
  unsigned variant;  ///< PointVariant.
};

}  // namespace hiprt::bench
