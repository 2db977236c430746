#pragma once
/// A sphere seen through instances and in motion, and how far hits are from its exact surface.

#include "engine.h"
#include "errors.h"

#include <hiprt_build/instances.h>
#include <tests/oracle/textbook_motion.h>

#include <functional>
#include <memory>

namespace hiprt::bench {

/// A sphere that a chain of instances transforms.
struct InstancedSphere {
  std::string name;
  Model model;  ///< The transformed mesh at `time`, with vertices rounded to floats.
  build::Buffer file;
  float time = 0.0f;  ///< Between two keys, if it moves.
  /// Transforms a point of the mesh to the scene at a time, in high precision, by the given matrices and keys.
  std::function<textbook::Real3(const textbook::Real3&, textbook::Real)> at;
  oracle::Mesh mesh;  ///< In object space.
  std::vector<std::unique_ptr<build::Motion>> motions;
  std::vector<build::Instance> chain;  ///< The innermost first.
};

/// One instance near and far from the origin, 16 nested instances, one that is flattened to a thousandth, and every
/// kind of motion.
build::Result<std::vector<InstancedSphere>> make_instanced_spheres();

/// Rays from inside to random points of the sphere, at times between the keys, and the exact t.
struct InstancedRays {
  std::vector<Ray> rays;
  std::vector<double> truths;
};
InstancedRays instanced_rays(const InstancedSphere& sphere, unsigned count);

/// Errors::other stays 0: at an edge both neighbours are right.
Errors measure_instanced(const InstancedSphere& sphere, const InstancedRays& instanced, std::span<const Hit> hits,
                         bool has_bounds);

}  // namespace hiprt::bench
