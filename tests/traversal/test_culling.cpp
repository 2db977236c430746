// What filters and custom primitives may ask: the side of a triangle, its normal, and the instances around it.

#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_device/math/vec_functions.h>
#include <hiprt_device/primitives/sphere.h>
#include <tests/oracle/brute_force.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/exact.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/instances/moving_scenes.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261126;
constexpr NodeLayout kLayouts[] = {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized};

struct ByReference : Policies {
  using Triangle = Reference;
};
struct ByFast : Policies {
  using Triangle = Fast;
};

/// The exact sign of dot(direction, normal) of a triangle.
int exact_side(const Ray& ray, const Corners& corners) {
  const auto vector = [](const auto& v) {
    return oracle::Integer3{oracle::scaled(v[0]), oracle::scaled(v[1]), oracle::scaled(v[2])};
  };
  const oracle::Integer3 p = vector(corners.p0);
  return sgn(dot(vector(ray.direction), cross(difference(vector(corners.p1), p), difference(vector(corners.p2), p))));
}

/// Accepts all hits and keeps what it was told about each.
template <class Real = float> struct Witness {
  struct Told {
    BasicHit<Real> hit;
    bool front;
    BasicVec3<Real> normal;
  };
  std::vector<Told>* told;
  template <class Questions>
  FilterResult operator()(const BasicRay<Real>&, const BasicHit<Real>& hit, const Questions& questions) const {
    told->push_back({hit, questions.is_front(), questions.normal()});
    return FilterResult::kAccept;
  }
};

/// Checks the sides and normals of all candidates of random rays in a soup.
/// @param grazing some rays lie nearly, or exactly, in the plane of a triangle.
template <class P> void check_sides(bool grazing) {
  using Real = typename P::Real;
  std::vector<Mesh> meshes{soup(400, 0.7, kSeed), star(2, kSeed)};
  const NodeLayout layout = P::Layout::kId;
  const auto bvh = build::build(views(meshes), {.nodes = layout});
  REQUIRE(bvh.has_value());
  const SceneView scene = bvh->scene();
  Random random(kSeed);
  unsigned asked = 0, fronts = 0;
  for (unsigned i = 0; i < trials(3000); ++i) {
    Ray ray{vec3(random.in_cube(1.5)), 0.0f, vec3(random.in_cube(1))};
    if (grazing) {
      const Corners at = corners(meshes[0], random.below(400));
      const Vec3 a = vec3(at.p0), b = vec3(at.p1), c = vec3(at.p2);
      ray.origin = a - 2.0f * (b - a);
      ray.direction = b + random.uniform_float(0, 1) * (c - b) - ray.origin;
    }
    std::vector<typename Witness<Real>::Told> told;
    const Witness<Real> witness{&told};
    PrivateStack<>::Memory memory;
    AnyHit<P, Witness<Real>> query(scene, convert<Real>(ray), memory, witness);
    while (query.next_hit().found()) {
    }
    INFO("seed " << kSeed << ", ray " << i);
    for (const auto& one : told) {
      const int side = exact_side(ray, corners(meshes[one.hit.geometry], one.hit.primitive));
      ++asked;
      fronts += one.front ? 1 : 0;
      INFO("geometry " << one.hit.geometry << ", triangle " << one.hit.primitive);
      if (side != 0) REQUIRE(one.front == (side < 0));
      // The normal is the hit's, to the last bit.
      const BasicRay<Real> again{convert<Real>(ray).origin, one.hit.t, convert<Real>(ray).direction, one.hit.t};
      const auto hit = closest_hit<P>(scene, again);
      if (hit.geometry == one.hit.geometry && hit.primitive == one.hit.primitive) REQUIRE(one.normal == hit.normal);
    }
  }
  CHECK(asked > trials(1000));
  CHECK(fronts > asked / 4);
  CHECK(fronts < 3 * asked / 4);
}

template <class P, class LayoutType> struct InLayout : P { using Layout = LayoutType; };

/// A ray from outside that meets the surface at an edge, a vertex or inside a triangle.
Ray ray_from_outside(const Closed& closed, Random& random) {
  const Double3 target = target_point(closed.mesh, random), away = random.on_sphere();
  Ray ray;
  for (int k = 0; k < 3; ++k)
    ray.origin[k] = static_cast<float>(closed.centers[0][static_cast<std::size_t>(k)] +
                                       8 * closed.scale * away[static_cast<std::size_t>(k)]);
  for (int k = 0; k < 3; ++k)
    ray.direction[k] = static_cast<float>(target[static_cast<std::size_t>(k)] - double{ray.origin[k]});
  return ray;
}

/// Rays from outside meet a closed surface with its backs culled where they meet it at all, and rays from inside with
/// its fronts culled.
template <class P> void check_closed(const Closed& closed) {
  using Real = typename P::Real;
  const std::vector<Mesh> meshes{closed.mesh};
  const auto bvh = build::build(views(meshes), {.nodes = P::Layout::kId});
  REQUIRE(bvh.has_value());
  const SceneView scene = bvh->scene();
  const auto check = [&](const Ray& ray, auto culled, auto other, unsigned i) {
    PrivateStack<>::Memory memory;
    const auto rays = convert<Real>(ray);
    const auto plain = closest_hit<P>(scene, rays);
    const auto kept = ClosestHit<P, decltype(culled)>(scene, rays, memory, culled).next_hit();
    const auto by_flags = ClosestHit<P, CullFaces>(scene, rays, memory, other).next_hit();
    INFO(closed.name << ", seed " << kSeed << ", ray " << i);
    REQUIRE(kept.found() == plain.found());
    REQUIRE(by_flags.primitive == kept.primitive);
    if (plain.found()) REQUIRE(std::abs(kept.t - plain.t) <= Real(1e-5) * plain.t);
    return plain.found() ? 1u : 0u;
  };
  Random random(kSeed);
  unsigned met = 0;
  const unsigned rays = trials(2000);
  for (unsigned i = 0; i < rays; ++i) {
    met += check(ray_from_outside(closed, random), CullBackFaces{}, CullFaces{}, i);
    met += check(aimed_ray(closed, random, 1e3), CullFrontFaces{}, CullFaces{.front = true, .back = false}, i);
  }
  CHECK(met > rays * 3 / 2);
}

}  // namespace

TEMPLATE_TEST_CASE("the side of a triangle is that of exact arithmetic", "", Policies, ByReference, ByFast,
                   DoubleRays<>) {
  for (const NodeLayout layout : kLayouts)
    dispatch_layout(layout, [&](auto type) { check_sides<InLayout<TestType, decltype(type)>>(false); });
}

TEST_CASE("the exact test knows the side also of rays along a triangle") { check_sides<ByReference>(true); }

TEMPLATE_TEST_CASE("closed surfaces do not leak where backs or fronts are culled", "", Policies, ByReference,
                   DoubleRays<>) {
  for (const Closed& closed : closed_meshes()) check_closed<TestType>(closed);
}

namespace {

struct RejectOdd {
  FilterResult operator()(const Ray&, const Hit& hit) const {
    return hit.primitive % 2 != 0 ? FilterResult::kReject : FilterResult::kAccept;
  }
};

}  // namespace

TEST_CASE("two filters, one after the other") {
  const std::vector<Mesh> meshes{soup(400, 0.7, kSeed)};
  const auto bvh = build::build(views(meshes));
  REQUIRE(bvh.has_value());
  const SceneView scene = bvh->scene();
  Random random(kSeed);
  unsigned hits = 0;
  for (unsigned i = 0; i < 500; ++i) {
    const Ray ray{vec3(random.in_cube(1.5)), 0.0f, vec3(random.in_cube(1))};
    PrivateStack<>::Memory memory;
    using Filter = BothFilters<CullBackFaces, RejectOdd>;
    const Hit hit =
        ClosestHit<Policies, Filter>(scene, ray, memory, BothFilters{CullBackFaces{}, RejectOdd{}}).next_hit();
    float nearest = std::numeric_limits<float>::infinity();
    ClosestHit<Policies> all(scene, ray, memory);
    for (Hit one = all.next_hit(); one.found() && nearest > one.t; one = all.next_hit())
      if (one.primitive % 2 == 0 && exact_side(ray, corners(meshes[0], one.primitive)) < 0) nearest = one.t;
    INFO("seed " << kSeed << ", ray " << i);
    REQUIRE(hit.t == nearest);
    hits += hit.found() ? 1 : 0;
  }
  CHECK(hits > 100);
}

namespace {

constexpr unsigned kMost = 3;

/// What a functor was told about the instances around a primitive.
struct ToldPath {
  std::uint32_t depth, ids[kMost];
  InstancePath<kMost> path;
};

template <class Questions> ToldPath read(const Questions& questions) {
  ToldPath told{questions.depth(), {}, {}};
  for (unsigned level = 0; level < told.depth; ++level) told.ids[level] = questions.instance_id(level);
  const auto path = questions.path();
  told.path.depth = path.depth;
  if constexpr (requires { path.instance[0]; })
    for (unsigned level = 0; level < path.depth; ++level) told.path.instance[level] = path.instance[level];
  return told;
}

/// A filter that keeps what it was told about the last candidate, which is the hit.
struct PathWitness {
  ToldPath* last;
  bool* front;
  Vec3* normal;
  template <class HitType, class Questions>
  FilterResult operator()(const Ray&, const HitType&, const Questions& questions) const {
    *last = read(questions);
    *front = questions.is_front();
    *normal = questions.normal();
    return FilterResult::kAccept;
  }
};

/// A unit sphere that keeps the path of its last report.
struct PathSphere {
  const Sphere* sphere;
  ToldPath* last;
  template <class Id, class Report>
  bool intersect(const Ray& ray, float tmin, float tmax, const Id& id, Report&& report) const {
    return SphereSet{sphere}.intersect(ray, tmin, tmax, 0u, [&](const CustomHit& hit) {
      if (hit.t >= tmin && hit.t <= tmax) *last = read(id);
      return report(hit);
    });
  }
};

/// Groups of groups, some of them mirrored or moving. Each instance has an id that no other one has.
struct NestedScene : InstanceScene {
  std::vector<build::Motion> motions;

  NestedScene(build::Buffer object, unsigned levels, bool moves) {
    Random random(kSeed + levels);
    files.push_back(std::move(object));
    motions.reserve(6 * levels);
    for (unsigned level = 0; level < levels; ++level) {
      groups.emplace_back(6);
      for (Instance& instance : groups.back()) {
        instance = {.object = level, .to_scene = random_affine(random, 3)};
        instance.id = 1000 * (level + 1) + static_cast<std::uint32_t>(&instance - groups.back().data());
        if (!moves || random.below(3) != 0) continue;
        const float x = random.uniform_float(-2, 2);
        motions.push_back({.keys = {{.time = 0, .translation = {x, 0, 0}},
                                    {.time = 1, .translation = {1, x, 0}, .rotation = {1, 0, 0, 1}}}});
        instance.motion = &motions.back();
      }
    }
    build();
  }

  void check(const ToldPath& told, const InstancePath<kMost>& path) const {
    REQUIRE(told.depth == path.depth);
    REQUIRE(told.path == path);
    for (unsigned level = 0; level < path.depth; ++level)
      REQUIRE(told.ids[level] == 1000 * (groups.size() - level) + path.instance[level]);
  }
};

template <class P> InstancePath<kMost> path_of(const BasicPathHit<float, P::kLevels>& hit) {
  InstancePath<kMost> path;
  path.depth = hit.path.depth;
  for (unsigned level = 0; level < path.depth; ++level) path.instance[level] = hit.path.instance[level];
  return path;
}

template <class P> void check_triangles(unsigned levels) {
  const std::vector<Mesh> meshes{star(2, kSeed)};
  auto object = build::build(views(meshes));
  REQUIRE(object.has_value());
  const NestedScene scene(std::move(object->buffer), levels, P::kMoves);
  const SceneView view = scene.view();
  Random random(kSeed);
  unsigned hits = 0, fronts = 0;
  for (unsigned i = 0; i < trials(1500); ++i) {
    const Ray ray = random_ray(random, 6.0);
    ToldPath told{};
    bool front = false;
    Vec3 normal{0};
    const PathWitness witness{&told, &front, &normal};
    const auto hit = closest_hit<P>(view, ray);
    typename P::Stack::Memory memory;
    ClosestHit<P, PathWitness> query(view, ray, memory, witness);
    const auto seen = query.next_hit();
    INFO("seed " << kSeed << ", ray " << i << ", levels " << levels);
    REQUIRE(seen.t == hit.t);
    if (!hit.found()) continue;
    ++hits;
    fronts += front ? 1 : 0;
    scene.check(told, path_of<P>(hit));
    REQUIRE(normal == hit.normal);
    const float side = glm::dot(hit.normal, ray.direction);
    if (std::abs(side) > 1e-3f * glm::length(hit.normal) * glm::length(ray.direction)) REQUIRE(front == (side < 0));
  }
  CHECK(hits > trials(100));
  CHECK(fronts > hits / 4);
}

template <class P> void check_spheres(unsigned levels) {
  const Sphere sphere{{0.1f, 0.2f, -0.1f}, 0.5f};
  const Box boxes[1] = {SphereSet::bounds(sphere)};
  const build::CustomGeometry geometry[1] = {{.boxes = boxes}};
  auto object = build::build(build::SceneInput{{}, geometry});
  REQUIRE(object.has_value());
  const NestedScene scene(std::move(object->buffer), levels, P::kMoves);
  const SceneView view = scene.view();
  Random random(kSeed);
  unsigned hits = 0;
  for (unsigned i = 0; i < trials(1500); ++i) {
    const Ray ray = random_ray(random, 6.0);
    ToldPath of_sphere{}, of_filter{};
    bool front = false;
    Vec3 normal{0};
    using Set = PrimitiveList<PathSphere>;
    typename P::Stack::Memory memory;
    ClosestHit<P, PathWitness, Set> query(view, ray, memory, PathWitness{&of_filter, &front, &normal},
                                          Set{PathSphere{&sphere, &of_sphere}});
    const auto hit = query.next_hit();
    if (!hit.found()) continue;
    INFO("seed " << kSeed << ", ray " << i << ", levels " << levels);
    ++hits;
    scene.check(of_sphere, path_of<P>(hit));
    scene.check(of_filter, path_of<P>(hit));
    REQUIRE(normal == hit.normal);
  }
  CHECK(hits > trials(50));
}

}  // namespace

TEST_CASE("filters and custom primitives know the instances around them") {
  check_triangles<Instanced<Policies, 1>>(1);
  check_triangles<Instanced<Policies, 3>>(1);
  check_triangles<Instanced<Policies, 3>>(3);
  check_triangles<Moving<Instanced<Policies, 3>>>(2);
  check_spheres<Instanced<Policies, 1>>(1);
  check_spheres<Moving<Instanced<Policies, 3>>>(3);
}

TEST_CASE("without instances there are none") {
  const std::vector<Mesh> meshes{icosphere(2)};
  const auto bvh = build::build(views(meshes));
  REQUIRE(bvh.has_value());
  const SceneView scene = bvh->scene();
  ToldPath told{7, {}, {}};
  bool front = true;
  Vec3 normal{0};
  PrivateStack<>::Memory memory;
  const Ray ray{Vec3(0), 0.0f, Vec3(1, 0.1f, 0.2f)};
  const PathWitness witness{&told, &front, &normal};
  const Hit hit = ClosestHit<Policies, PathWitness>(scene, ray, memory, witness).next_hit();
  REQUIRE(hit.found());
  CHECK(told.depth == 0);
  CHECK_FALSE(front);
  CHECK(normal == hit.normal);
}
