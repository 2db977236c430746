/// The tracer for scenes with one level of instances.

#include <tools/render/tracers/choose_policies.h>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

template void trace_levels<1>(const TraceJob& job);

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
