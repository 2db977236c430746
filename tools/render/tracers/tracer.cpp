#include <tools/render/tracers/tracer.h>

#include <hiprt_build/host/isa.h>
#include <hiprt_build/trace_rays.h>
#include <hiprt_device/host_scene.h>
#include <tools/render/scene/path_scene.h>
#include <tools/render/tracers/trace_job.h>

#include <string_view>

namespace hiprt::tools {

#define HIPRT_ISA(name) void trace_##name(const TraceJob& job);
HIPRT_ISA_LIST
#undef HIPRT_ISA

namespace {

struct Isa {
  std::string_view name;
  void (*trace)(const TraceJob& job);
};

/// Worst first.
constexpr Isa kIsas[] = {
#define HIPRT_ISA(name) {#name, &trace_##name},
    HIPRT_ISA_LIST
#undef HIPRT_ISA
};

const Isa& chosen_isa() {
  static const Isa& chosen = format_detail::best_isa(kIsas);
  return chosen;
}

}  // namespace

void trace(const SceneView& scene, Query query, const TracePolicies& policies, std::span<const Ray> rays,
           std::span<Hit> hits, std::span<RayCost> costs, std::span<std::uint32_t> paths) {
  // The library's own tracer is faster where the scene is prepared for the host. It may find another of several hits.
  if (query == Query::kClosest && policies == TracePolicies{} && costs.empty() &&
      current_host_scene(scene) != nullptr) {
    static_cast<void>(closest_hits(scene, rays, hits));
    return;
  }
  chosen_isa().trace({&scene,
                      query,
                      policies,
                      rays.data(),
                      hits.data(),
                      costs.empty() ? nullptr : costs.data(),
                      paths.empty() ? nullptr : paths.data(),
                      rays.size(),
                      nullptr,
                      {}});
}

void trace(const PathScene& scene, Query query, std::span<const Ray> rays, std::span<Hit> hits,
           std::span<std::uint32_t> paths) {
  chosen_isa().trace({&scene.view,
                      query,
                      {},
                      rays.data(),
                      hits.data(),
                      nullptr,
                      paths.empty() ? nullptr : paths.data(),
                      rays.size(),
                      &scene,
                      {}});
}

void trace_steps(const SceneView& scene, Query query, const TracePolicies& policies, const Ray& ray, Hit& hit,
                 RayCost& cost, std::span<std::uint32_t> path, const StepSink& sink) {
  chosen_isa().trace(
      {&scene, query, policies, &ray, &hit, &cost, path.empty() ? nullptr : path.data(), 1, nullptr, sink});
}

const char* trace_isa() { return chosen_isa().name.data(); }

}  // namespace hiprt::tools
