#include <tools/render/tracers/point_tracer.h>

#include <hiprt_build/host/isa.h>

#include <string_view>

namespace hiprt::tools {

#define HIPRT_ISA(name)                         \
  bool find_points_##name(const PointJob& job); \
  bool find_sides_##name(const SideJob& job);   \
  bool find_overlaps_##name(const OverlapJob& job);
HIPRT_ISA_LIST
#undef HIPRT_ISA

namespace {

struct PointIsa {
  std::string_view name;
  bool (*points)(const PointJob& job);
  bool (*sides)(const SideJob& job);
  bool (*overlaps)(const OverlapJob& job);
};

/// Worst first.
constexpr PointIsa kPointIsas[] = {
#define HIPRT_ISA(name) {#name, &find_points_##name, &find_sides_##name, &find_overlaps_##name},
    HIPRT_ISA_LIST
#undef HIPRT_ISA
};

const PointIsa& chosen_point_isa() {
  static const PointIsa& chosen = format_detail::best_isa(kPointIsas);
  return chosen;
}

}  // namespace

bool find(const PointJob& job) { return chosen_point_isa().points(job); }
bool find(const SideJob& job) { return chosen_point_isa().sides(job); }
bool find(const OverlapJob& job) { return chosen_point_isa().overlaps(job); }

}  // namespace hiprt::tools
