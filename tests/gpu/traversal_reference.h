#pragma once
/// Hits of the host, by the same headers. A GPU's hits must equal them.

#include <tests/gpu/random_scene.h>
#include <tests/gpu/traversal_job.h>

#include <vector>

namespace hiprt::checks {

/// Of one ray.
struct Expected {
  Hit closest;
  std::uint32_t near_count = 0;   ///< Of the first kDepth hits.
  std::uint64_t near_digest = 0;  ///< Sum of their digests.
  std::vector<Hit> all;           ///< With the fields that the policies report: normal, error.
  std::uint64_t all_digest = 0;
};

/// A scene's rays and what they hit, without a filter and with RejectSome.
struct HostResults {
  std::vector<Ray> rays;
  std::vector<bool> at_edge;  ///< Of each ray.
  std::vector<Expected> plain, rejecting;
  const std::vector<Expected>& of(Filtering filter) const { return filter == Filtering::kReject ? rejecting : plain; }
};

/// @param count rays of that seed. @param scene of layout planes.
HostResults make_host_results(const SceneSource& source, const SceneView& scene, unsigned count, std::uint64_t seed);

/// @param depth number of hits that the test takes from the query. @return whether the result is right.
bool is_right(const QueryResult& result, const Expected& expected, Query query, Filtering filter, unsigned depth);
/// The same within rounding: for other triangle tests.
bool is_nearly_right(const QueryResult& result, const Expected& expected, Query query);

/// Every bit of the numbers.
std::string text(const Hit& hit);
std::string text(const Ray& ray);

}  // namespace hiprt::checks
