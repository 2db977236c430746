#pragma once
/// Every hit of a ray, by the library's watertight test on every triangle: a traversal must find them bit for bit.
/// (test_hits.cpp compares those hits with exact arithmetic.) Also the helpers that the tests of queries share.

#include <hiprt_device/hiprt_device.h>
#include <tests/oracle/brute_force.h>
#include <tests/traversal/scenes.h>
#include <tests/traversal/tracers.h>

#include <algorithm>
#include <tuple>

namespace hiprt::checks {

/// What tells a hit from the others of its ray, and the order in which closest hits come.
inline auto hit_key(const Hit& hit) { return std::tuple(hit.t, hit.geometry, hit.primitive); }
inline void sort_hits(std::vector<Hit>& hits) {
  std::stable_sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) { return hit_key(a) < hit_key(b); });
}
inline std::vector<Hit> sorted(std::vector<Hit> hits) {
  sort_hits(hits);
  return hits;
}
/// The first of those with the same key.
inline std::vector<Hit> unique(std::vector<Hit> hits) {
  sort_hits(hits);
  hits.erase(std::unique(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) { return hit_key(a) == hit_key(b); }),
             hits.end());
  return hits;
}
/// The same hits in the same order, bit for bit.
inline bool same_hits(const std::vector<Hit>& a, const std::vector<Hit>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same_hit);
}
/// The hits as any-hit queries and filters see them.
inline std::vector<Hit> without_surface(std::vector<Hit> hits) {
  for (Hit& hit : hits) {
    hit.normal = Vec3(0);
    hit.error = 0;
  }
  return hits;
}
template <class Keep> std::vector<Hit> kept(const std::vector<Hit>& hits, const Keep& keep) {
  std::vector<Hit> result;
  std::copy_if(hits.begin(), hits.end(), std::back_inserter(result), keep);
  return result;
}

inline bool in_range(const Ray& ray, float t) {
  return t >= effective_tmin(ray) && t <= std::min(ray.tmax, std::numeric_limits<float>::max());
}

/// A leaf of one triangle, corners as in the mesh.
inline PlanesLeaf leaf_of(const Corners& c, std::uint32_t geometry, std::uint32_t primitive) {
  PlanesLeaf leaf{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    const Position* const corner[] = {&c.p0, &c.p1, &c.p2, &c.p2};
    for (unsigned v = 0; v < 4; ++v) leaf.coordinate[axis][v] = (*corner[v])[axis];
  }
  leaf.info = {{primitive, kInvalidId}, geometry | kLastInRun, TriangleId::from_rotation(0)};
  return leaf;
}

/// Calls add(hit) for the triangle's hit, if the ray meets it.
template <class Add> void add_hit(const Ray& ray, const PlanesLeaf& leaf, const Add& add) {
  const Watertight::PreparedRay<ArrayLanes> prepared(ray);
  Watertight::intersect<ArrayLanes>(leaf, leaf.info, prepared, [&](const Candidate& at, unsigned slot) {
    if (slot != 0 || !in_range(ray, at.t)) return true;
    Hit hit{at.t, at.u, at.v, leaf.info.geometry_and_flags & kGeometryMask, leaf.info.primitive[0]};
    complete<PlanesLayout>(hit, ray, leaf, 0);
    add(hit);
    return true;
  });
}

/// In the order of t, geometry, primitive.
inline std::vector<Hit> every_hit(std::span<const Mesh> meshes, const Ray& ray) {
  std::vector<Hit> hits;
  if (!is_traceable(ray)) return hits;
  for (std::uint32_t g = 0; g < meshes.size(); ++g) {
    if ((meshes[g].mask & ray.mask) == 0) continue;
    for (std::uint32_t i = 0; i < meshes[g].triangles.size(); ++i)
      if (const Corners c = corners(meshes[g], i); !is_dropped(c))
        add_hit(ray, leaf_of(c, g, i), [&](const Hit& hit) { hits.push_back(hit); });
  }
  return sorted(std::move(hits));
}

/// Policies that the queries' tests vary.
template <class LayoutPolicy, class SchedulePolicy = Immediate, class LanesPolicy = DefaultLanes,
          class StackPolicy = PrivateStack<>, FeatureMask kFeatureSet = kKnownFeatures>
struct Tried : Policies {
  using Layout = LayoutPolicy;
  using Stack = StackPolicy;
  using Lanes = LanesPolicy;
  using Counter = WorkCounter;
  using Schedule = SchedulePolicy;
  static constexpr FeatureMask kFeatures = kFeatureSet;
};

/// The stack of one ray, with memory as the policy requires.
template <class Stack> struct RayStack {
  typename Stack::Storage storage() const { return {}; }
};
template <OwnedStack Stack> struct RayStack<Stack> {
  typename Stack::Memory memory;
  typename Stack::Storage storage() { return typename Stack::Storage(memory); }
};

/// The hits of a query until its end.
struct Drained {
  std::vector<Hit> hits;
  std::string wrong;  ///< What was wrong with its states, or "".
  WorkCounter work{};
};

/// Calls next_hit() until the end and three times after it. @param most hits; more are a fault.
template <class Query> Drained drain(Query& query, std::size_t most = 100000) {
  Drained result;
  if (query.state() != TraversalState::kInit) result.wrong = "not kInit at first";
  for (Hit hit = query.next_hit(); hit.found() && result.hits.size() <= most; hit = query.next_hit()) {
    if (query.state() != TraversalState::kHit) result.wrong = "not kHit with a hit";
    result.hits.push_back(hit);
  }
  if (result.hits.size() > most) result.wrong = "no end of hits";
  for (int again = 0; again < 3; ++again) {
    if (query.state() != TraversalState::kFinished) result.wrong = "not kFinished at the end";
    if (!same_hit(query.next_hit(), Hit{})) result.wrong = "not a miss after the end";
  }
  result.work = query.counter();
  return result;
}

/// The queries under one set of policies, drained.
template <class P, class Filter = NoFilter, class Primitives = NoPrimitives> struct Queries {
  const SceneView& scene;
  Filter filter{};
  Primitives primitives{};

  Drained closest(const Ray& ray) const {
    RayStack<typename P::Stack> stack;
    ClosestHit<P, Filter, Primitives> query(scene, ray, stack.storage(), filter, primitives);
    return drain(query);
  }
  Drained any(const Ray& ray) const {
    RayStack<typename P::Stack> stack;
    AnyHit<P, Filter, Primitives> query(scene, ray, stack.storage(), filter, primitives);
    return drain(query);
  }
  template <SplitPrimitives kSplit = SplitPrimitives::kOnce> Drained all(const Ray& ray) const {
    RayStack<typename P::Stack> stack;
    AllHits<P, Filter, Primitives, kSplit> query(scene, ray, stack.storage(), filter, primitives);
    return drain(query);
  }
};

inline bool is_split(const SceneView& scene) { return (scene.features & feature_bit(Feature::kSplitReferences)) != 0; }

/// What is wrong with the hits of the queries, or "". @param expected all hits that the filter accepts, sorted. Hits
/// that a custom primitive reports twice at one t are in it twice.
template <class P, class Filter, class Primitives>
std::string find_fault(const Queries<P, Filter, Primitives>& queries, const Ray& ray,
                       const std::vector<Hit>& expected) {
  const Drained closest = queries.closest(ray), any = queries.any(ray), once = queries.all(ray),
                repeat = queries.template all<SplitPrimitives::kRepeat>(ray);
  for (const auto& [name, drained] : {std::pair("closest: ", &closest), {"any: ", &any}, {"all: ", &once}})
    if (!drained->wrong.empty()) return name + drained->wrong;
  if (!repeat.wrong.empty()) return "all, repeated: " + repeat.wrong;
  if (!same_hits(closest.hits, unique(expected))) return "closest hits differ";
  const bool split = is_split(queries.scene);
  if (!same_hits(sorted(once.hits), expected)) return "all hits differ";
  if (!same_hits(split ? unique(repeat.hits) : sorted(repeat.hits), expected)) return "repeated hits differ";
  // A custom primitive tells its normal to any-hit queries too.
  const std::vector<Hit> seen = split ? unique(any.hits) : sorted(any.hits);
  if (!same_hits(without_surface(seen), without_surface(expected))) return "any hits differ";
  return "";
}

}  // namespace hiprt::checks
