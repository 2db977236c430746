/// The tracers for scenes with spheres and curves.

#include <tools/render/tracers/choose_policies.h>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

template void trace_accurate<0, false, Watertight, SceneShapes>(const TraceJob& job);
template void trace_accurate<kTraceLevels, true, Watertight, SceneShapes>(const TraceJob& job);

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
