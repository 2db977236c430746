/// Closest points with the default policies, compiled once per instruction set (HIPRT_ISA_NAME).

#include "kernel.h"

#include <hiprt_device/query/closest_point.h>

#define HIPRT_JOIN_EXPANDED(a, b) a##b
#define HIPRT_JOIN_NAMES(a, b) HIPRT_JOIN_EXPANDED(a, b)
#define HIPRT_BENCH_POINTS HIPRT_JOIN_NAMES(bench_points_, HIPRT_ISA_NAME)

namespace hiprt::bench {

void HIPRT_BENCH_POINTS(const PointJob& job) {
  Policies::Stack::Memory stack;
  for (std::size_t i = 0; i < job.count; ++i)
    job.distances[i] = closest_point<Policies>(*job.scene, {.point = job.points[i]}, stack).distance();
}

}  // namespace hiprt::bench
