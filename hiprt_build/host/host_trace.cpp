/// Compiled once per instruction set (HIPRT_ISA_NAME).

#include <hiprt_build/host/host_search.h>
#include <hiprt_build/host/host_trace.h>

#include <new>

#define HIPRT_JOIN_EXPANDED(a, b) a##b
#define HIPRT_JOIN(a, b) HIPRT_JOIN_EXPANDED(a, b)

namespace hiprt::format_detail {
namespace {

Hit trace_closest(const SceneView& scene, const Ray& ray) { return HostSearch<true>(scene, ray).run(); }

Hit trace_any(const SceneView& scene, const Ray& ray) { return HostSearch<false>(scene, ray).run(); }

void trace_closest_hits(const SceneView& scene, const Ray* rays, Hit* hits, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) hits[i] = trace_closest(scene, rays[i]);
}

void trace_any_hits(const SceneView& scene, const Ray* rays, Hit* hits, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) hits[i] = trace_any(scene, rays[i]);
}

}  // namespace

const HostTracer& HIPRT_JOIN(host_tracer_, HIPRT_ISA_NAME)() {
  static constexpr HostTracer kTracer{trace_closest, trace_any, trace_closest_hits, trace_any_hits};
  return kTracer;
}

}  // namespace hiprt::format_detail
