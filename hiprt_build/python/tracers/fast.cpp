/// The tracer that is fastest and may miss at edges.

#include <hiprt_build/python/tracers/trace_loop.h>

namespace hiprt::python {
inline namespace HIPRT_ISA_NAMESPACE {

void trace_fast(const TraceJob& job) { trace_with<FlatPolicies<PlanesLayout, Fast, Plain>>(job); }

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::python
