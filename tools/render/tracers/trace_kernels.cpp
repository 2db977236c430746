/// Chooses the smallest tracer that covers a job. Compiled once per instruction set (HIPRT_ISA_NAME).

#include <tools/render/tracers/trace_kernels.h>

#include <tools/render/scene/trace_limits.h>

#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/primitives/scene_shapes.h>

#define HIPRT_JOIN_EXPANDED(a, b) a##b
#define HIPRT_JOIN(a, b) HIPRT_JOIN_EXPANDED(a, b)
#define HIPRT_TRACE HIPRT_JOIN(trace_, HIPRT_ISA_NAME)

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {
namespace {

void trace_cutout(const TraceJob& job, bool moves, bool custom) {
  const std::uint32_t levels = job.scene->levels;
  if (levels == 0 && !custom) return trace_alpha_cutout<0, false>(job);
  return levels == 1 && !moves && !custom ? trace_alpha_cutout<1, false>(job)
                                          : trace_alpha_cutout<kTraceLevels, true>(job);
}

}  // namespace
}  // namespace HIPRT_ISA_NAMESPACE

void HIPRT_TRACE(const TraceJob& job);

void HIPRT_TRACE(const TraceJob& job) {
  const std::uint32_t levels = job.scene->levels;
  const bool moves = (job.scene->features & feature_bit(Feature::kMotion)) != 0;
  const bool custom = (job.scene->features & feature_bit(Feature::kCustom)) != 0;
  if (job.cutout_scene != nullptr) return trace_cutout(job, moves, custom);
  const bool plain = levels == 0 && job.sink.take == nullptr && job.costs == nullptr;
  if (job.policies.triangle_test == TriangleTestKind::kReference)
    return plain && !custom ? trace_accurate<0, false, Reference, NoPrimitives>(job)
                            : trace_accurate<kTraceLevels, true, Reference, SceneShapes>(job);
  if (custom)
    return plain ? trace_accurate<0, false, Watertight, SceneShapes>(job)
                 : trace_accurate<kTraceLevels, true, Watertight, SceneShapes>(job);
  if (moves || job.sink.take != nullptr || (levels != 0 && job.costs != nullptr))
    return trace_levels<kTraceLevels, true>(job);
  if (levels == 0) return trace_levels<0>(job);
  levels == 1 ? trace_levels<1>(job) : trace_levels<kTraceLevels>(job);
}

}  // namespace hiprt::tools
