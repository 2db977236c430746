#pragma once
/// Boxes hide no hit: a traversal finds the hits of a loop over all triangles, bit for bit.

#include <hiprt_device/intersect/exact_triangle_test.h>
#include <hiprt_device/primitives/computed_leaf.h>
#include <tests/flags/check.h>
#include <tests/flags/lattice.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

namespace hiprt::flags {

/// The hit of one triangle, if there is one, by a triangle test alone.
template <class Test, class Real>
[[gnu::noinline]] BasicHit<Real> try_triangle(const Mesh& mesh, std::uint32_t primitive, const BasicRay<Real>& ray,
                                              const typename Test::template PreparedRay<ArrayLanes>& prepared) {
  using primitive_detail::ComputedLeaf, primitive_detail::ComputedLeaves;
  const Real tmin = std::max(ray.tmin, Real(0));
  BasicHit<Real> found;
  ComputedLeaf<float> leaf{};
  for (unsigned corner = 0; corner < 3; ++corner)
    for (unsigned axis = 0; axis < 3; ++axis)
      leaf.vertex[corner][axis] = mesh.positions[mesh.triangles[primitive][corner]][axis];
  leaf.info = {{primitive, kInvalidId}, 0, TriangleId::from_rotation(0)};
  Test::template intersect<ArrayLanes>(leaf, leaf.info, prepared,
                                       [&](const BasicCandidate<Real>& at, unsigned triangle) {
                                         if (triangle != 0 || !(at.t >= tmin && at.t <= ray.tmax)) return true;
                                         found.t = at.t;
                                         found.u = at.u;
                                         found.v = at.v;
                                         found.geometry = 0;
                                         found.primitive = primitive;
                                         complete<ComputedLeaves<float>>(found, ray, leaf, 0);
                                         return true;
                                       });
  return found;
}

/// The closest hit of a mesh when every triangle is tried, in the order of ray.h. Boxes, trees and leaves of two have
/// no part in it.
template <class Test, class Real>
[[gnu::noinline]] BasicHit<Real> try_all(const Mesh& mesh, const BasicRay<Real>& ray) {
  const typename Test::template PreparedRay<ArrayLanes> prepared(ray);
  BasicHit<Real> best;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto hit = try_triangle<Test>(mesh, i, ray, prepared);
    if (hit.found() && !(best.found() && hit.t >= best.t)) best = hit;
  }
  return best;
}

/// The same of a scene of instances of one mesh, each tried.
template <class P>
BasicPathHit<typename P::Real, 1> try_all_instances(const SceneView& scene, const Mesh& mesh, std::uint32_t instances,
                                                    const BasicRay<typename P::Real>& ray) {
  BasicPathHit<typename P::Real, 1> best;
  for (std::uint32_t i = 0; i < instances; ++i) {
    const InstanceRecord record = ObjectView(scene).template instance<P::kMoves>(i, ray.time);
    const auto hit = try_all<typename P::Triangle>(mesh, ray_to_object(record, ray));
    if (!hit.found() || (best.found() && hit.t >= best.t)) continue;
    static_cast<BasicHit<typename P::Real>&>(best) = hit;
    best.path.depth = 1;
    best.path.instance[0] = i;
  }
  return best;
}

/// Whether both are the same hit. Normals and errors: in instances they are the scene's.
template <class Real>
bool expect_same(Check& check, const BasicHit<Real>& expected, const BasicHit<Real>& hit, bool with_surface) {
  if (!expected.found())
    return check.expect(!hit.found(), "triangle %u is hit at t %a, though none is when all are tried", hit.primitive,
                        double{hit.t});
  if (!check.expect(hit.found(), "a box hides triangle %u at t %a", expected.primitive, double{expected.t}))
    return false;
  bool same = hit.t == expected.t && hit.u == expected.u && hit.v == expected.v && hit.geometry == expected.geometry &&
              hit.primitive == expected.primitive;
  if (with_surface) same = same && hit.normal == expected.normal && hit.error == expected.error;
  return check.expect(same, "triangle %u at t %a (u %a, v %a) is hit in place of %u at %a (%a, %a) or its surface",
                      hit.primitive, double{hit.t}, double{hit.u}, double{hit.v}, expected.primitive,
                      double{expected.t}, double{expected.u}, double{expected.v});
}

/// Separate triangles: a ray that misses the box of one hits no neighbour instead. The boxes of half of them have no
/// thickness.
inline Mesh lattice_soup(unsigned triangles) {
  Random random(kSeed + 3);
  Mesh mesh;
  for (unsigned i = 0; i < triangles; ++i) {
    const Vec3 center = lattice_point(random, 4096);
    Vec3 corner[3];
    for (Vec3& c : corner) c = center + lattice_point(random, i % 4 == 0 ? 16 : 512);
    if (i % 2 == 0)
      for (Vec3& c : corner) c[static_cast<int>(i / 2 % 3)] = center.x;
    const auto position = [](const Vec3& p) { return build::Position{p.x, p.y, p.z}; };
    oracle::append(mesh, position(corner[0]), position(corner[1]), position(corner[2]));
  }
  return mesh;
}

/// A ray from one point to another. Its direction is their difference times a factor.
struct Aim {
  Vec3 from, to;
  float factor;

  Ray ray() const {
    Ray result = between(from, to);
    result.direction *= factor;
    return result;
  }
};

/// At what touches the box of a triangle: a corner, the middle of an edge or a point inside; half of the time beside it
/// by 2^-10 to 2^-24. From near and from far, along an axis, in a plane across one, or from the surface on.
inline Aim aim_at_boxes(const Vec3& a, const Vec3& b, const Vec3& c, Random& random) {
  const std::uint32_t where = random.below(4), how = random.below(8);
  const Vec3 middle = 0.5f * (a + b);
  Vec3 at = where < 2 ? a : where == 2 ? middle : 0.5f * (middle + c);
  const Vec3 beside = lattice_point(random, 4);
  const auto halvings = static_cast<int>(random.below(12));
  if (random.coin()) at += beside * std::ldexp(1.0f, -halvings);
  Vec3 direction = lattice_point(random, how < 5 ? 32768 : 2048);
  for (std::uint32_t axis = 0; how < 3 && axis < 3; ++axis)
    if (axis != how) direction[static_cast<int>(axis)] = axis == 1 ? -0.0f : 0.0f;
  if (how == 3) direction.y = 0.0f;
  if (how == 4) direction *= 64.0f;
  if (max_component(direction) == 0.0f) direction.z = 1.0f;
  const bool leaves = random.below(8) == 0;
  const float factor = power(random, 8);
  return {leaves ? at : at - direction, leaves ? at + direction : at, factor};
}

/// Rays, and their hits by a loop over all triangles.
template <class HitType, class Real> struct Trials {
  std::vector<BasicRay<Real>> rays;
  std::vector<HitType> hits;
};

/// @return faults of a tree. @tparam kSurface whether normals and errors have to be the same.
template <class P, bool kSurface, class HitType, class Real>
unsigned expect_trials(const std::string& name, const SceneView& scene, const Trials<HitType, Real>& trials) {
  Check check(name + ": no box hides a hit", kSeed + 4);
  check.expect(covers<P>(scene), "the scene is not for these policies");
  for (std::size_t i = 0; i < trials.rays.size(); ++i) {
    BasicRay<Real> ray = trials.rays[i];
    const HitType& expected = trials.hits[i];
    check.on_ray(ray);
    const auto hit = closest<P>(scene, ray);
    check.on_hit(hit);
    expect_same(check, expected, hit, kSurface);
    if constexpr (P::kLevels != 0)
      check.expect(!hit.found() || hit.path == expected.path, "instance %u is hit in place of %u", hit.path.instance[0],
                   expected.path.instance[0]);
    if (!expected.found()) continue;
    // The one point of the ray that is hit.
    ray.tmin = ray.tmax = expected.t;
    const auto again = closest<P>(scene, ray);
    check.expect(again.found() && again.t == expected.t && again.primitive == expected.primitive,
                 "not hit again in [t, t] of its own t %a", double{expected.t});
  }
  return check.finish(static_cast<unsigned>(trials.rays.size() / 4));
}

struct QuantizedInArrays : WithLayout<QuantizedLayout> {
  using Lanes = ArrayLanes;
};
struct ByReference : Policies {
  using Triangle = Reference;
};

/// A soup under every layout and triangle test. @param offset, scale of it: (p + offset) * scale, scale a power of two.
inline unsigned boxes_of_meshes(const std::string& location, const Vec3& offset, float scale) {
  Mesh at_home = lattice_soup(64), mesh = at_home;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    for (unsigned axis = 0; axis < 3; ++axis) {
      at_home.positions[i][axis] += offset[static_cast<int>(axis)];
      mesh.positions[i][axis] = at_home.positions[i][axis] * scale;
    }
  Random random(kSeed + 4);
  Trials<Hit, float> watertight, reference;
  Trials<HitD, double> of_double;
  for (unsigned i = 0; i < 600; ++i) {
    const build::Triangle t = any_triangle(at_home, random);
    Ray ray = aim_at_boxes(vec3(at_home.positions[t[0]]), vec3(at_home.positions[t[1]]), vec3(at_home.positions[t[2]]),
                           random)
                  .ray();
    ray.origin *= scale;
    watertight.rays.push_back(ray);
    watertight.hits.push_back(try_all<Watertight>(mesh, ray));
    reference.hits.push_back(try_all<Reference>(mesh, ray));
    of_double.rays.push_back(convert<double>(ray));
    of_double.hits.push_back(try_all<WatertightDouble>(mesh, of_double.rays.back()));
  }
  reference.rays = watertight.rays;
  const build::TriangleMesh views[] = {mesh.view()};
  const auto built = [&](NodeLayout nodes) {
    return must(build::build(views, {.nodes = nodes, .max_leaf_triangles = 1, .pair_triangles = false}));
  };
  const build::Bvh floats = built(NodeLayout::kFloat), planes = built(NodeLayout::kPlanes),
                   half = built(NodeLayout::kHalf), quantized = built(NodeLayout::kQuantized);
  const auto name = [&](const char* of) { return location + ", " + of; };
  unsigned faults = expect_trials<WithLayout<FloatLayout>, true>(name("float"), view_of(floats), watertight);
  faults += expect_trials<Policies, true>(name("planes"), view_of(planes), watertight);
  faults += expect_trials<WithLayout<HalfLayout>, true>(name("half"), view_of(half), watertight);
  faults += expect_trials<WithLayout<QuantizedLayout>, true>(name("quantized"), view_of(quantized), watertight);
  faults += expect_trials<QuantizedInArrays, true>(name("quantized, ArrayLanes"), view_of(quantized), watertight);
  faults += expect_trials<ByReference, true>(name("Reference"), view_of(planes), reference);
  faults += expect_trials<DoubleRays<>, true>(name("double"), view_of(planes), of_double);
  return faults;
}

/// Rays at the boxes of a mesh in instances, and their hits by a loop over all triangles of all instances.
template <class P>
Trials<BasicPathHit<typename P::Real, 1>, typename P::Real> trials_of_instances(const SceneView& scene,
                                                                                const Mesh& mesh,
                                                                                std::uint32_t instances,
                                                                                unsigned rays) {
  Random random(kSeed + 5);
  Trials<BasicPathHit<typename P::Real, 1>, typename P::Real> trials;
  for (unsigned i = 0; i < rays; ++i) {
    const InstancePath<1> path{1, {random.below(instances)}};
    const build::Triangle t = any_triangle(mesh, random);
    const float time = P::kMoves ? any_time(random) : 0.0f;
    const unsigned first = random.below(3);
    const auto corner = [&](unsigned c) {
      return to_scene(scene, path, time, vec3(mesh.positions[t[(first + c) % 3]]));
    };
    Ray ray = aim_at_boxes(corner(0), corner(1), corner(2), random).ray();
    ray.time = time;
    trials.rays.push_back(convert<typename P::Real>(ray));
    trials.hits.push_back(try_all_instances<P>(scene, mesh, instances, trials.rays.back()));
  }
  return trials;
}

/// Instances of one triangle, which do not move. Its corners touch the box of the object. Transforms turn the triangle
/// in all directions, and most make it nearly flat. The instances lie around the origin; in a second scene far from it.
template <class P> unsigned boxes_of_instances(const std::string& name) {
  constexpr std::uint32_t kInstances = 64;
  Mesh mesh = lattice_soup(2);
  mesh.triangles.erase(mesh.triangles.begin());
  const build::TriangleMesh views[] = {mesh.view()};
  const build::Bvh object =
      must(build::build(views, {.nodes = P::Layout::kId, .max_leaf_triangles = 1, .pair_triangles = false}));
  const std::span<const std::byte> files[] = {object.buffer.bytes()};
  unsigned faults = 0;
  for (const bool far : {false, true}) {
    Random random(kSeed + 6);
    build::Instance instances[kInstances];
    for (std::uint32_t i = 0; i < kInstances; ++i) {
      instances[i].to_scene = lattice_affine(random, 2, i % 4 == 0 ? 1.0f : 0x1p-12f);
      const float offset[] = {700.0f, -1000.0f, 300.0f};
      for (unsigned r = 0; far && r < 3; ++r) instances[i].to_scene.row[r][3] += offset[r];
    }
    const build::Bvh whole =
        must(build::build_instances(files, instances, {.bounds = build::InstanceBounds::kPrimitives}));
    const SceneView scene = view_of(whole);
    faults += expect_trials<P, false>(name + (far ? ", far away" : ""), scene,
                                      trials_of_instances<P>(scene, mesh, kInstances, 1500));
  }
  return faults;
}

}  // namespace hiprt::flags
