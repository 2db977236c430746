/// The closest points of triangles, spheres and curves. Compiled once per instruction set (HIPRT_ISA_NAME).

#include <tools/render/tracers/point_policies.h>

#include <hiprt_device/primitives/scene_shapes.h>

#include <algorithm>
#include <cmath>

#define HIPRT_FIND_POINTS HIPRT_JOIN(find_points_, HIPRT_ISA_NAME)

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {
namespace {

template <class P> bool give(const PointJob& job, std::size_t query, const ClosestPointOf<float, P::kLevels>& near) {
  std::uint32_t path[kTraceLevels];
  store_path_of<P>(near, path, job.scene->levels);
  return job.sink.take(job.sink.to, query, near, path);
}

/// A distance within which there are `count` triangles, because points of theirs are that near. It is not certain:
/// points are rounded, and instances may have moved.
template <class Result> float likely_reach(const Vec3& from, const Result* points, std::uint32_t count) {
  double squared = 0.0, coordinate = 0.0;
  for (std::uint32_t k = 0; k < count; ++k) {
    const Vec3D at(points[k].point), away = at - Vec3D(from);
    squared = std::max(squared, away.x * away.x + away.y * away.y + away.z * away.z);
    coordinate = std::max({coordinate, std::abs(at.x), std::abs(at.y), std::abs(at.z)});
  }
  return static_cast<float>(std::sqrt(squared) * (1.0 + 0x1p-20) + 0x1p-21 * coordinate);
}

/// Finds the nearest triangles of queries in their order. The results of one query limit the search of the next one,
/// which is often near. If the limit was too small, the next query is asked again without it. So results do not depend
/// on it: all triangles of a full result are in the limit, and no other triangle is nearer.
template <class P, class Primitives> class NearestOfEach {
  using Result = ClosestPointOf<float, P::kLevels>;

 public:
  NearestOfEach(const PointJob& job, const typename P::Stack::Storage& storage, const Primitives& primitives)
      : job_(job), storage_(storage), primitives_(primitives), results_(static_cast<Result*>(job.scratch)) {}

  /// @param go_on becomes false when the sink wants no more.
  FoundCount find(std::size_t query, bool& go_on) {
    PointQuery limited = job_.queries[query];
    if (last_ == job_.nearest) limited.max_distance = likely_reach(limited.point, results_, last_);
    const bool is_limited = limited.max_distance < job_.queries[query].max_distance;
    FoundCount found;
    if (is_limited) found = ask(limited);
    if (found.count < job_.nearest && !found.failed()) found = ask(job_.queries[query]);
    last_ = found.count;
    for (std::uint32_t k = 0; k < found.count && go_on; ++k) go_on = give<P>(job_, query, results_[k]);
    return found;
  }

 private:
  FoundCount ask(const PointQuery& query) const {
    return nearest_points<P>(*job_.scene, query, results_, job_.nearest, storage_, NoFilter{}, primitives_);
  }

  const PointJob& job_;
  typename P::Stack::Storage storage_;
  Primitives primitives_;
  Result* results_;
  std::uint32_t last_ = 0;  ///< How many results the last query has.
};

template <class P, class Primitives>
FoundCount find_within(const PointJob& job, std::size_t query, const typename P::Stack::Storage& storage,
                       const Primitives& primitives, bool& go_on) {
  return points_within<P, SplitPrimitives::kRepeat>(
      *job.scene, job.queries[query], storage,
      [&](const ClosestPointOf<float, P::kLevels>& near) { return go_on = give<P>(job, query, near); }, primitives);
}

template <class P, class Primitives> bool find_all(const PointJob& job, const Primitives& primitives) {
  typename P::Stack::Memory memory;
  const typename P::Stack::Storage storage(memory);
  NearestOfEach<P, Primitives> nearest(job, storage, primitives);
  bool go_on = true;
  for (std::size_t i = 0; i < job.count && go_on; ++i) {
    const FoundCount found =
        job.nearest != 0 ? nearest.find(i, go_on) : find_within<P>(job, i, storage, primitives, go_on);
    if (found.failed()) return false;
  }
  return true;
}

struct FindAll {
  const PointJob& job;
  template <class P> bool operator()() const { return find_all<P>(job, NoPrimitives{}); }
};

/// Policies with levels serve flat scenes, too: these are compiled once per layout.
bool find_shapes(const PointJob& job) {
  return dispatch_layout(job.scene->layout, [&](auto layout) {
    using P = LevelPolicies<FlatPolicies<decltype(layout)>, kTraceLevels, true>;
    return find_all<P>(job, SceneShapes(*job.scene));
  });
}

}  // namespace
}  // namespace HIPRT_ISA_NAMESPACE

bool HIPRT_FIND_POINTS(const PointJob& job);

bool HIPRT_FIND_POINTS(const PointJob& job) {
  if ((job.scene->features & feature_bit(Feature::kCustom)) != 0) return find_shapes(job);
  return with_point_policies(*job.scene, FindAll{job});
}

}  // namespace hiprt::tools
