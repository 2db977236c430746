/// The closest points of triangles. Distances are in double for all queries, so there is one tracer for both
/// precisions.

#include <hiprt_build/python/tracers/trace_loop.h>

namespace hiprt::python {
inline namespace HIPRT_ISA_NAMESPACE {
namespace {

template <class P, class Result>
bool give(const PointJob& job, std::size_t query, const Result& near, std::uint32_t* path) {
  store_path<P>(near, path, job.scene->levels);
  const ListedPoint listed{near.distance_squared, near.point,     near.u,      near.v,
                           near.geometry,         near.primitive, near.feature};
  return job.sink.take(job.sink.to, query, listed, path);
}

/// @return how it went. @p go_on false: the sink wants no more.
template <class P>
FoundCount find_nearest(const PointJob& job, std::size_t query, const typename P::Stack::Storage& storage,
                        bool& go_on) {
  using Result = ClosestPointOf<double, P::kLevels>;
  static_assert(sizeof(Result) <= kPathPointBytes);
  auto* const results = static_cast<Result*>(job.scratch);
  const FoundCount found = nearest_points<P>(*job.scene, job.queries[query], results, job.nearest, storage);
  std::uint32_t path[kMostLevels];
  for (std::uint32_t k = 0; k < found.count && go_on; ++k) go_on = give<P>(job, query, results[k], path);
  return found;
}

template <class P>
FoundCount find_within(const PointJob& job, std::size_t query, const typename P::Stack::Storage& storage, bool& go_on) {
  std::uint32_t path[kMostLevels];
  return points_within<P, SplitPrimitives::kRepeat>(
      *job.scene, job.queries[query], storage,
      [&](const ClosestPointOf<double, P::kLevels>& near) { return go_on = give<P>(job, query, near, path); });
}

template <class P> bool find_all(const PointJob& job) {
  typename P::Stack::Memory memory;
  bool go_on = true;
  for (std::size_t i = 0; i < job.count && go_on; ++i) {
    const FoundCount found =
        job.nearest != 0 ? find_nearest<P>(job, i, memory, go_on) : find_within<P>(job, i, memory, go_on);
    if (found.failed()) return false;
  }
  return true;
}

template <class Layout> using PointPolicies = DoubleRays<FlatPolicies<Layout>>;

}  // namespace

bool find_points(const PointJob& job) {
  if (is_flat(*job.scene)) return find_all<PointPolicies<PlanesLayout>>(job);
  return dispatch_layout(job.scene->layout, [&](auto layout) {
    return find_all<Moving<Instanced<PointPolicies<decltype(layout)>, kMostLevels>>>(job);
  });
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::python
