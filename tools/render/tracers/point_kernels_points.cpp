/// The closest points of triangles. Compiled once per instruction set (HIPRT_ISA_NAME).

#include <tools/render/tracers/point_policies.h>

#define HIPRT_FIND_POINTS HIPRT_JOIN(find_points_, HIPRT_ISA_NAME)

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {
namespace {

template <class P> bool give(const PointJob& job, std::size_t query, const ClosestPointOf<float, P::kLevels>& near) {
  std::uint32_t path[kTraceLevels];
  store_path_of<P>(near, path, job.scene->levels);
  return job.sink.take(job.sink.to, query, near, path);
}

/// @param go_on becomes false when the sink wants no more.
template <class P>
FoundCount find_nearest(const PointJob& job, std::size_t query, const typename P::Stack::Storage& storage,
                        bool& go_on) {
  auto* const results = static_cast<ClosestPointOf<float, P::kLevels>*>(job.scratch);
  const FoundCount found = nearest_points<P>(*job.scene, job.queries[query], results, job.nearest, storage);
  for (std::uint32_t k = 0; k < found.count && go_on; ++k) go_on = give<P>(job, query, results[k]);
  return found;
}

template <class P>
FoundCount find_within(const PointJob& job, std::size_t query, const typename P::Stack::Storage& storage, bool& go_on) {
  return points_within<P, SplitPrimitives::kRepeat>(
      *job.scene, job.queries[query], storage,
      [&](const ClosestPointOf<float, P::kLevels>& near) { return go_on = give<P>(job, query, near); });
}

struct FindAll {
  const PointJob& job;

  template <class P> bool operator()() const {
    typename P::Stack::Memory memory;
    bool go_on = true;
    for (std::size_t i = 0; i < job.count && go_on; ++i) {
      const FoundCount found =
          job.nearest != 0 ? find_nearest<P>(job, i, memory, go_on) : find_within<P>(job, i, memory, go_on);
      if (found.failed()) return false;
    }
    return true;
  }
};

}  // namespace
}  // namespace HIPRT_ISA_NAMESPACE

bool HIPRT_FIND_POINTS(const PointJob& job);

bool HIPRT_FIND_POINTS(const PointJob& job) { return with_point_policies(*job.scene, FindAll{job}); }

}  // namespace hiprt::tools
