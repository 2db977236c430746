/// The entries of an instruction set. Compiled once per instruction set (HIPRT_ISA_NAME).

#include <hiprt_build/python/tracers/kernels.h>

#define HIPRT_JOIN_EXPANDED(a, b) a##b
#define HIPRT_JOIN(a, b) HIPRT_JOIN_EXPANDED(a, b)
#define HIPRT_TRACE HIPRT_JOIN(trace_, HIPRT_ISA_NAME)
#define HIPRT_FIND_POINTS HIPRT_JOIN(find_points_, HIPRT_ISA_NAME)
#define HIPRT_FIND_OVERLAPS HIPRT_JOIN(find_overlaps_, HIPRT_ISA_NAME)

namespace hiprt::python {

void HIPRT_TRACE(const TraceJob& job);
bool HIPRT_FIND_POINTS(const PointJob& job);
bool HIPRT_FIND_OVERLAPS(const OverlapJob& job);

void HIPRT_TRACE(const TraceJob& job) {
  switch (job.precision) {
    case Precision::kReference:
      return trace_reference(job);
    case Precision::kDouble:
      return trace_double(job);
    case Precision::kFast:
      return is_flat(*job.scene) ? trace_fast(job) : trace_watertight(job);
    case Precision::kWatertight:
      return trace_watertight(job);
  }
}

bool HIPRT_FIND_POINTS(const PointJob& job) { return find_points(job); }
bool HIPRT_FIND_OVERLAPS(const OverlapJob& job) { return find_overlaps(job); }

}  // namespace hiprt::python
