/// The traversal of scenes whose instances move.

#include <tools/render/tracers/trace_kernels.h>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

template void trace_levels<kTraceLevels, true>(const TraceJob& job);

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
