/// The tracers for rays in double precision.

#include <hiprt_build/python/tracers/trace_loop.h>

namespace hiprt::python {
inline namespace HIPRT_ISA_NAMESPACE {

template <class Layout> using DoublePolicies = DoubleRays<FlatPolicies<Layout>>;

void trace_double(const TraceJob& job) {
  if (is_flat(*job.scene)) return trace_with<DoublePolicies<PlanesLayout>>(job);
  trace_general<DoublePolicies>(job);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::python
