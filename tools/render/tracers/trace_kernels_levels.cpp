/// The tracer for scenes whose instances contain instances.

#include <tools/render/tracers/choose_policies.h>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

template void trace_levels<kTraceLevels>(const TraceJob& job);

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
