/// The tracers with exact decisions (Reference).

#include <tools/render/tracers/choose_policies.h>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

template void trace_accurate<0, false, Reference, NoPrimitives>(const TraceJob& job);
template void trace_accurate<kTraceLevels, true, Reference, SceneShapes>(const TraceJob& job);

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
