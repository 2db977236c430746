/// The tracers with exact decisions.

#include <hiprt_build/python/tracers/trace_loop.h>

namespace hiprt::python {
inline namespace HIPRT_ISA_NAMESPACE {

template <class Layout> using ReferencePolicies = FlatPolicies<Layout, Reference>;

void trace_reference(const TraceJob& job) {
  if (is_flat(*job.scene)) return trace_with<ReferencePolicies<PlanesLayout>>(job);
  trace_general<ReferencePolicies>(job);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::python
