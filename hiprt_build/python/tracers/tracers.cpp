#include <hiprt_build/python/tracers/tracers.h>

#include <hiprt_build/host/isa.h>

#include <string_view>

namespace hiprt::python {

#define HIPRT_ISA(name)                         \
  void trace_##name(const TraceJob& job);       \
  bool find_points_##name(const PointJob& job); \
  bool find_overlaps_##name(const OverlapJob& job);
HIPRT_ISA_LIST
#undef HIPRT_ISA

namespace {

struct Isa {
  std::string_view name;
  void (*trace)(const TraceJob& job);
  bool (*find_points)(const PointJob& job);
  bool (*find_overlaps)(const OverlapJob& job);
};

/// Worst first.
constexpr Isa kIsas[] = {
#define HIPRT_ISA(name) {#name, &trace_##name, &find_points_##name, &find_overlaps_##name},
    HIPRT_ISA_LIST
#undef HIPRT_ISA
};

const Isa& chosen_isa() {
  static const Isa& chosen = format_detail::best_isa(kIsas);
  return chosen;
}

}  // namespace

void trace(const TraceJob& job) { chosen_isa().trace(job); }

bool find(const PointJob& job) { return chosen_isa().find_points(job); }
bool find(const OverlapJob& job) { return chosen_isa().find_overlaps(job); }

bool has_only_triangles(const SceneView& scene) { return (scene.features & feature_bit(Feature::kCustom)) == 0; }

bool is_traceable(const SceneView& scene) {
  const bool shapes_known = scene.shapes != 0 || (scene.features & feature_bit(Feature::kCustom)) == 0;
  return scene.levels <= kMostLevels && scene.stack_bound <= kMostEntries && shapes_known;
}

const char* trace_isa() { return chosen_isa().name.data(); }

}  // namespace hiprt::python
