#include <tests/gpu/traversal_reference.h>

#include <algorithm>
#include <cstdio>

namespace hiprt::checks {

namespace {

template <class Filter, class Primitives>
Expected trace_on_host(const SceneView& scene, const Ray& ray, const Primitives& primitives) {
  using P = Policies;
  P::Stack::Memory memory;
  Expected expected;
  ClosestHit<P, Filter, Primitives> closest(scene, ray, memory, {}, primitives);
  for (Hit hit = closest.next_hit(); hit.found() && expected.near_count < kDepth; hit = closest.next_hit()) {
    if (expected.near_count++ == 0) expected.closest = hit;
    expected.near_digest += digest_of(hit);
  }
  AllHits<P, Filter, Primitives> all(scene, ray, memory, {}, primitives);
  for (Hit hit = all.next_hit(); hit.found(); hit = all.next_hit()) {
    expected.all.push_back(hit);
    expected.all_digest += digest_of(hit);
  }
  return expected;
}

template <class Filter>
std::vector<Expected> trace_all_on_host(const SceneSource& source, const SceneView& scene,
                                        const std::vector<Ray>& rays) {
  std::vector<Expected> expected;
  expected.reserve(rays.size());
  const std::vector<std::uint32_t> segments = segments_of(source.hair);
  const Customs customs{SphereSet{source.spheres.data()}, RoundCurveSet{source.hair.data(), segments.data()}};
  for (const Ray& ray : rays)
    expected.push_back(source.has_customs() ? trace_on_host<Filter>(scene, ray, customs)
                                            : trace_on_host<Filter>(scene, ray, NoPrimitives{}));
  return expected;
}

/// @param whole normal and error too, which any-hit queries leave out for triangles.
bool is_among(const Hit& hit, const std::vector<Hit>& hits, bool whole) {
  return std::any_of(hits.begin(), hits.end(), [&](Hit other) {
    if (!whole) {
      other.normal = hit.normal;
      other.error = hit.error;
    }
    return digest_of(other) == digest_of(hit);
  });
}

}  // namespace

HostResults make_host_results(const SceneSource& source, const SceneView& scene, unsigned count, std::uint64_t seed) {
  HostResults reference;
  oracle::Random random(seed);
  for (unsigned i = 0; i < count; ++i) {
    const AimedRay aimed = random_ray(source, random);
    reference.rays.push_back(aimed.ray);
    reference.at_edge.push_back(aimed.at_edge);
  }
  reference.plain = trace_all_on_host<NoFilter>(source, scene, reference.rays);
  reference.rejecting = trace_all_on_host<RejectSome>(source, scene, reference.rays);
  return reference;
}

bool is_right(const QueryResult& result, const Expected& expected, Query query, Filtering filter, unsigned depth) {
  const bool found = result.hit.found();
  if (result.failed != 0 || result.state == TraversalState::kStackOverflow) return false;
  if (found != expected.closest.found()) return false;
  if (query == Query::kAll && filter == Filtering::kStop && found)
    return result.count == 1 && is_among(result.hit, expected.all, true);
  if (query == Query::kAll) return result.count == expected.all.size() && result.digest == expected.all_digest;
  if (!found) return result.count == 0 && digest_of(result.hit) == digest_of(Hit{});
  if (query == Query::kAny) return is_among(result.hit, expected.all, false);
  if (filter == Filtering::kStop) return result.count == 1 && is_among(result.hit, expected.all, true);
  if (depth == kDepth && (result.count != expected.near_count || result.digest != expected.near_digest)) return false;
  return digest_of(result.hit) == digest_of(expected.closest);
}

bool is_nearly_right(const QueryResult& result, const Expected& expected, Query query) {
  if (result.failed != 0 || result.hit.found() != expected.closest.found()) return false;
  if (!result.hit.found()) return true;
  const auto resembles = [&](const Hit& hit) {
    const auto near = [](float a, float b, float scale) { return std::abs(a - b) <= 1e-4f * scale; };
    return hit.geometry == result.hit.geometry && hit.primitive == result.hit.primitive &&
           near(hit.t, result.hit.t, std::abs(hit.t)) && near(hit.u, result.hit.u, 10.0f) &&
           near(hit.v, result.hit.v, 10.0f);
  };
  if (query == Query::kClosest) return resembles(expected.closest);
  return std::any_of(expected.all.begin(), expected.all.end(), resembles);
}

std::string text(const Hit& hit) {
  char line[256];
  std::snprintf(line, sizeof line, "t %a u %a v %a geometry %u primitive %u normal %a %a %a error %a",
                static_cast<double>(hit.t), static_cast<double>(hit.u), static_cast<double>(hit.v), hit.geometry,
                hit.primitive, static_cast<double>(hit.normal.x), static_cast<double>(hit.normal.y),
                static_cast<double>(hit.normal.z), static_cast<double>(hit.error));
  return line;
}

std::string text(const Ray& ray) {
  char line[256];
  std::snprintf(line, sizeof line, "origin %a %a %a direction %a %a %a tmin %a tmax %a mask %u",
                static_cast<double>(ray.origin.x), static_cast<double>(ray.origin.y), static_cast<double>(ray.origin.z),
                static_cast<double>(ray.direction.x), static_cast<double>(ray.direction.y),
                static_cast<double>(ray.direction.z), static_cast<double>(ray.tmin), static_cast<double>(ray.tmax),
                ray.mask);
  return line;
}

}  // namespace hiprt::checks
