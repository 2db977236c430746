/// The traversal, compiled once per instruction set (HIPRT_ISA_NAME) in the combinations of policies that run on CPUs.

#include "box_set.h"
#include "cpu_kernels.h"

#include <hiprt_device/format/layout.h>
#include <hiprt_device/hiprt_device.h>

#define HIPRT_JOIN_EXPANDED(a, b) a##b
#define HIPRT_JOIN(a, b) HIPRT_JOIN_EXPANDED(a, b)
#define HIPRT_BENCH_VARIANTS HIPRT_JOIN(bench_variants_, HIPRT_ISA_NAME)

namespace hiprt::bench {

void HIPRT_BENCH_VARIANTS(const CpuJob& job);

namespace {

template <class P, class Primitives> void trace_all(const CpuJob& job, const Primitives& primitives) {
  typename P::Stack::Memory stack;
  switch (job.query) {
    case Query::kClosest:
      for (std::size_t i = 0; i < job.count; ++i)
        job.hits[i] = ClosestHit<P, NoFilter, Primitives>(*job.scene, job.rays[i], stack, {}, primitives).next_hit();
      return;
    case Query::kAny:
      for (std::size_t i = 0; i < job.count; ++i)
        job.hits[i] = OneHit<P, NoFilter, Primitives>(*job.scene, job.rays[i], stack, {}, primitives).next_hit();
      return;
    case Query::kAll:
      for (std::size_t i = 0; i < job.count; ++i) {
        AllHits<P, NoFilter, Primitives> query(*job.scene, job.rays[i], stack, {}, primitives);
        job.results[i] = sum_of_hits(query);
      }
      return;
  }
}

/// With instances a stack holds what all levels need.
template <class P> struct Deep : Moving<Instanced<P, kCpuLevels>> {
  using Stack = LevelStack<PrivateStack<2048>, kCpuLevels>;
};

template <class P> void choose_primitives(const CpuJob& job) {
  if (job.levels != 0)
    trace_all<Deep<P>>(job, NoPrimitives{});
  else if (job.boxes == nullptr)
    trace_all<P>(job, NoPrimitives{});
  else
    trace_all<P>(job, PrimitiveList<BoxSet>{BoxSet{job.boxes}});
}

template <class Layout> struct Quick : WithLayout<Layout> {
  using Triangle = Fast;
  using Boxes = Plain;
};

template <class Layout> void choose_tests(const CpuJob& job) {
  job.fast ? choose_primitives<Quick<Layout>>(job) : choose_primitives<WithLayout<Layout>>(job);
}

}  // namespace

void HIPRT_BENCH_VARIANTS(const CpuJob& job) {
  switch (job.scene->layout) {
    case NodeLayout::kFloat:
      return choose_tests<FloatLayout>(job);
    case NodeLayout::kPlanes:
      return choose_tests<PlanesLayout>(job);
    case NodeLayout::kHalf:
      return choose_tests<HalfLayout>(job);
    case NodeLayout::kQuantized:
      return choose_tests<QuantizedLayout>(job);
  }
}

}  // namespace hiprt::bench
