#pragma once
/// The traversal of one ray, step by step.

#include <tools/render/tracers/tracer.h>

#include <hiprt_build/format/view.h>

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace hiprt::tools {

struct Explanation {
  std::vector<TraceStep> steps;
  Hit hit;
  std::vector<std::uint32_t> path;  ///< SceneView::levels numbers (instance_paths.h).
  RayCost cost;
};

/// Traces one ray by trace_steps().
/// @pre check_traceable() accepts the scene.
Explanation explain(const SceneView& scene, Query query, const TracePolicies& policies, const Ray& ray);

/// The steps as JSON: {"ray", "steps": [...], "hit", "path", "work"}. Nodes, leaves and instances are numbered within
/// the file that has them: the scene's, or the object's that "object" names.
///   {"node": 3, "children": [{"node": 4, "t": 1.5}, {"leaf": 7, "missed": true}]}
///   {"leaf": 7, "geometry": 0, "primitives": [{"primitive": 12, "t": 2.5, "verdict": "closest so far"},
///                                             {"primitive": 13, "verdict": "not met"}]}
///   {"leaf": 2, "instance": 5, "of": 1, "id": 77, "verdict": "entered", "node": 0}
///   {"left": 5}
/// "unvisited" counts children whose boxes the ray meets but that were not visited because a hit was nearer.
nlohmann::json explanation_json(const BufferView& file, const Ray& ray, const Explanation& explanation);

/// The same as text: one line per step, indented by the level of instances.
std::string explanation_text(const nlohmann::json& explanation);

}  // namespace hiprt::tools
