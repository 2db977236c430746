#include <tools/cli/trace/explain.h>

namespace hiprt::tools {

Explanation explain(const SceneView& scene, Query query, const TracePolicies& policies, const Ray& ray) {
  Explanation result;
  result.path.resize(scene.levels);
  const StepSink sink{
      [](void* to, const TraceStep& step) { static_cast<std::vector<TraceStep>*>(to)->push_back(step); },
      &result.steps};
  trace_steps(scene, query, policies, ray, result.hit, result.cost, result.path, sink);
  return result;
}

}  // namespace hiprt::tools
