/// The general tracer: several levels of instances that may move.

#include <tools/render/tracers/choose_policies.h>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

template void trace_levels<kTraceLevels, true>(const TraceJob& job);

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
