/// The traversal of scenes with spheres and curves.

#include "trace_kernels.h"

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

template void trace_shapes<0, false>(const TraceJob& job);
template void trace_shapes<kTraceLevels, true>(const TraceJob& job);

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
