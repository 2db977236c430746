#pragma once
/// A closed mesh seen through instances and in motion: how far its hits are from where it truly is.

#include "engine.h"
#include "errors.h"

#include <hiprt_build/instances.h>
#include <tests/oracle/textbook_motion.h>

#include <functional>
#include <memory>

namespace hiprt::bench {

/// A sphere that a chain of instances puts into a scene.
struct Place {
  std::string name;
  Model model;  ///< As it is in the scene at `time`, vertices rounded to floats.
  build::Buffer file;
  float time = 0.0f;  ///< Between two keys, if it moves.
  /// Where a point of the mesh is in the scene at a time, by the matrices and keys that were asked for.
  std::function<textbook::Real3(const textbook::Real3&, textbook::Real)> at;
  oracle::Mesh mesh;  ///< In its own coordinates.
  std::vector<std::unique_ptr<build::Motion>> motions;
  std::vector<build::Instance> chain;  ///< The innermost first.
};

/// One instance near and far from the origin, 16 in each other, one that is flat to a thousandth; and every kind of
/// motion.
build::Result<std::vector<Place>> make_places();

/// Rays from inside at random places of it, at times between the keys, and the exact t.
struct PlacedRays {
  std::vector<Ray> rays;
  std::vector<double> truths;
};
PlacedRays placed_rays(const Place& place, unsigned count);

/// Errors::other is not told: neighbours at an edge are as good as each other.
Errors measure_placed(const Place& place, const PlacedRays& placed, std::span<const Hit> hits, bool has_bounds);

}  // namespace hiprt::bench
