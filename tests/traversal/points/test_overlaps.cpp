// Overlaps of volumes and triangles, against triangles that are clipped in rationals.

#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/instances/instance_scenes.h>
#include <tests/traversal/points/point_queries.h>

#include <tests/catch.h>

#include <cstdio>
#include <set>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261203;

/// The points with normal . x <= most.
struct HalfSpace {
  Rational3 normal;
  Rational most;
};

Rational3 exact3(const Vec3& v) { return oracle::exact3(v.x, v.y, v.z); }
Rational3 scaled(const Rational3& a, const Rational& by) { return {a[0] * by, a[1] * by, a[2] * by}; }
Rational3 plus(const Rational3& a, const Rational3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
using rational_detail::cross, rational_detail::dot, rational_detail::minus;

/// Whether any point of the triangle is in all half spaces (Sutherland and Hodgman 1974), each moved outwards.
bool clip(const std::vector<HalfSpace>& spaces, const RationalCorners& corners, double outwards) {
  std::vector<Rational3> polygon(corners.begin(), corners.end());
  for (const HalfSpace& space : spaces) {
    const Rational most =
        space.most + Rational(outwards) * (abs(space.normal[0]) + abs(space.normal[1]) + abs(space.normal[2]));
    std::vector<Rational3> inside;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Rational3 &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
      const Rational from = dot(space.normal, a) - most, to = dot(space.normal, b) - most;
      if (from <= 0) inside.push_back(a);
      if ((from < 0 && to > 0) || (from > 0 && to < 0))
        inside.push_back(plus(a, scaled(minus(b, a), Rational(from / (from - to)))));
    }
    polygon = std::move(inside);
  }
  return !polygon.empty();
}

/// Both sides of a slab around a point.
void add_slab(std::vector<HalfSpace>& spaces, const Rational3& normal, const Rational& low, const Rational& high) {
  spaces.push_back({normal, high});
  spaces.push_back({scaled(normal, Rational(-1)), Rational(-low)});
}
std::vector<HalfSpace> half_spaces(const Box& box) {
  std::vector<HalfSpace> spaces;
  for (unsigned k = 0; k < 3; ++k) {
    Rational3 axis{0, 0, 0};
    axis[k] = 1;
    add_slab(spaces, axis, Rational(double{box.min[k]}), Rational(double{box.max[k]}));
  }
  return spaces;
}
std::vector<HalfSpace> half_spaces(const OrientedBox& box) {
  std::vector<HalfSpace> spaces;
  const Rational3 center = exact3(box.center);
  for (unsigned k = 0; k < 3; ++k) {
    const Rational3 normal = cross(exact3(box.half_edge[(k + 1) % 3]), exact3(box.half_edge[(k + 2) % 3]));
    const Rational middle = dot(normal, center), half = abs(dot(normal, exact3(box.half_edge[k])));
    add_slab(spaces, normal, middle - half, middle + half);
  }
  return spaces;
}
/// @pre faces are planar.
std::vector<HalfSpace> half_spaces(const Frustum& frustum) {
  std::vector<HalfSpace> spaces;
  Rational3 p[8], middle{0, 0, 0};
  for (unsigned k = 0; k < 4; ++k) {
    p[k] = exact3(frustum.near_corner[k]), p[4 + k] = exact3(frustum.far_corner[k]);
    middle = plus(middle, scaled(plus(p[k], p[4 + k]), Rational(1, 8)));
  }
  const auto add = [&](unsigned a, unsigned b, unsigned c) {
    Rational3 normal = cross(minus(p[b], p[a]), minus(p[c], p[a]));
    if (dot(normal, minus(middle, p[a])) > 0) normal = scaled(normal, Rational(-1));
    spaces.push_back({normal, dot(normal, p[a])});
  };
  add(0, 1, 2), add(4, 5, 6);
  for (unsigned k = 0; k < 4; ++k) add(4 + k, 4 + (k + 1) % 4, k);
  return spaces;
}
std::vector<HalfSpace> half_spaces(const TriangleVolume& triangle) {
  std::vector<HalfSpace> spaces;
  const Rational3 a = exact3(triangle.corner[0]), b = exact3(triangle.corner[1]), c = exact3(triangle.corner[2]);
  const Rational3 normal = cross(minus(b, a), minus(c, a));
  add_slab(spaces, normal, dot(normal, a), dot(normal, a));
  const Rational3 corner[3] = {a, b, c};
  for (unsigned k = 0; k < 3; ++k) {
    const Rational3 out = cross(minus(corner[(k + 1) % 3], corner[k]), normal);
    spaces.push_back({out, dot(out, corner[k])});
  }
  return spaces;
}

Vec3 somewhere(Random& random, double extent) { return vec3(random.in_cube(extent)); }
/// @param a a point of the mesh: where its vertex or edge is, the box touches it.
Box random_box(Random& random, double scale, const Position& a) {
  const Position b = random.in_cube(scale * random.log_uniform(1e-3, 1));
  Box box{};
  for (unsigned k = 0; k < 3; ++k) {
    box.min[k] = std::min(a[k], a[k] + b[k]);
    box.max[k] = random.below(6) == 0 ? box.min[k] : std::max(a[k], a[k] + b[k]);
  }
  return box;
}
OrientedBox random_oriented(Random& random, double scale, const Position& at) {
  OrientedBox box{vec3(at), {}};
  for (Vec3& edge : box.half_edge) edge = somewhere(random, scale * random.log_uniform(1e-3, 0.5));
  return box;
}
/// On integers, so that faces are planar.
Frustum random_frustum(Random& random, double scale, const Position&) {
  const auto whole = [&](std::uint32_t most) { return static_cast<float>(1 + random.below(most)); };
  const float near_half = whole(3), far_half = near_half + whole(8), length = whole(12),
              step = static_cast<float>(scale / 16);
  const float x = whole(30) - 15, y = whole(30) - 15, z = whole(30) - 15;
  const unsigned axis = random.below(3);
  Frustum frustum;
  for (unsigned k = 0; k < 4; ++k) {
    const float u = k == 0 || k == 3 ? -1.0f : 1.0f, v = k < 2 ? -1.0f : 1.0f;
    const auto at = [&](float half, float along) {
      const float p[3] = {x + u * half, y + v * half, z + along};
      return Vec3(p[axis] * step, p[(axis + 1) % 3] * step, p[(axis + 2) % 3] * step);
    };
    frustum.near_corner[k] = at(near_half, 0);
    frustum.far_corner[k] = at(far_half, length);
  }
  return frustum;
}

using Found = std::set<std::pair<std::uint32_t, std::uint32_t>>;

template <class P = Policies, class Volume> Found ask(const SceneView& scene, const Volume& volume) {
  Found found;
  typename P::Stack::Memory memory;
  const auto take = [&](const auto& overlap) {
    found.insert({overlap.geometry, overlap.primitive});
    return true;
  };
  const FoundCount count = overlaps<P>(scene, volume, memory, take);
  REQUIRE((count.state == TraversalState::kFinished && count.count >= found.size()));
  REQUIRE(any_overlap<P>(scene, volume, memory).found() == !found.empty());
  return found;
}

/// Nothing is missed, and nothing is reported that is farther than rounding.
template <class Volume> std::size_t judge(const Mesh& mesh, const Found& found, const Volume& volume, double slack) {
  const auto spaces = half_spaces(volume);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const Corners c = corners(mesh, i);
    if (is_dropped(c)) continue;
    const bool reported = found.count({0, i}) != 0;
    INFO("triangle " << i << ", reported: " << reported);
    if (reported) REQUIRE(clip(spaces, exact_corners(c), slack));
    if (!reported) REQUIRE(!clip(spaces, exact_corners(c), 0.0));
  }
  return found.size();
}

template <class Make> void check(const char* what, const Make& make) {
  std::size_t found = 0;
  for (const auto& [unit, scale] : {std::pair{star(2, 3), 1.0},
                                    {oracle::needles(120, 1e5, 7), 1e10},
                                    {icosphere(2), 1e-15},
                                    {grid_plane(8, 2, 0.25f), 1.0}}) {
    const Mesh mesh = oracle::placed(unit, scale);
    const std::array scenes{make_scene({mesh}),
                            make_scene({mesh}, {.builder = kEmbreeHigh, .nodes = NodeLayout::kHalf}),
                            make_scene({mesh}, {.nodes = NodeLayout::kQuantized, .max_leaf_triangles = 8})};
    Random random(kSeed);
    for (unsigned i = 0; i < trials(60); ++i) {
      const auto volume = make(random, scale, rounded(target_point(mesh, random)));
      INFO(what << ", seed " << kSeed << ", volume " << i << ", scale " << scale);
      Found first;
      for (const Scene& scene : scenes)
        with_policies(scene, [&](auto policies) {
          const Found now = ask<decltype(policies)>(scene.traced, volume);
          if (&scene == &scenes[0]) first = now;
          REQUIRE(now == first);
        });
      found += judge(mesh, first, volume, 0x1p-44 * scale);
    }
  }
  REQUIRE(found > trials(100));
}

}  // namespace

TEST_CASE("overlaps with boxes: none is missed") { check("box", random_box); }
TEST_CASE("overlaps with exact boxes are those of rationals") {
  std::size_t found = 0, conservative = 0;
  for (const auto& [unit, scale] : {std::pair{star(2, 3), 1.0},
                                    {oracle::needles(120, 1e5, 7), 1e10},
                                    {icosphere(1), 1e-40},
                                    {grid_plane(8, 2, 0.25f), 1e35}}) {
    const Mesh mesh = oracle::placed(unit, scale);
    const Scene scene = make_scene({mesh});
    Random random(kSeed + 3);
    for (unsigned i = 0; i < trials(400); ++i) {
      const Box box = random_box(random, scale, rounded(target_point(mesh, random)));
      INFO("seed " << kSeed + 3 << ", box " << i << ", scale " << scale);
      found += judge(mesh, ask(scene.traced, ExactBox{box}), box, 0.0);
      conservative += ask(scene.traced, box).size();
    }
  }
  std::printf("exact boxes, seed %llu: %zu overlaps, conservative %zu\n", static_cast<unsigned long long>(kSeed) + 3,
              found, conservative);
  REQUIRE((found > trials(1000) && conservative >= found));
}

TEST_CASE("a box and a triangle on a lattice touch in every way") {
  Random random(kSeed + 4);
  unsigned meets = 0;
  const auto lattice = [&] { return static_cast<float>(random.below(5)) - 2.0f; };
  const unsigned count = trials(30000);
  for (unsigned i = 0; i < count; ++i) {
    const Corners c{
        {lattice(), lattice(), lattice()}, {lattice(), lattice(), lattice()}, {lattice(), lattice(), lattice()}};
    Box box{};
    for (unsigned k = 0; k < 3; ++k) {
      box.min[k] = lattice();
      box.max[k] = box.min[k] + static_cast<float>(random.below(3));
    }
    const Vec3 corner[3] = {vec3(c.p0), vec3(c.p1), vec3(c.p2)};
    const bool expected = clip(half_spaces(box), exact_corners(c), 0.0);
    INFO("seed " << kSeed + 4 << ", case " << i);
    REQUIRE(box_meets_triangle(box, corner) == expected);
    meets += expected ? 1 : 0;
  }
  REQUIRE((meets > count / 10 && meets < count - count / 10));
}

TEST_CASE("overlaps with oriented boxes: none is missed") { check("oriented box", random_oriented); }
TEST_CASE("overlaps with frustums: none is missed") { check("frustum", random_frustum); }
TEST_CASE("overlaps with triangles: none is missed") {
  check("triangle", [](Random& random, double scale, const Position& at) {
    return TriangleVolume{
        {random.coin() ? vec3(at) : somewhere(random, scale), somewhere(random, scale), somewhere(random, scale)}};
  });
}

TEST_CASE("overlaps with spheres are the triangles within the radius") {
  const std::vector<Mesh> meshes{star(3, 5), oracle::soup(200, 0.2, 2)};
  const Scene scene = make_scene(meshes);
  Random random(kSeed + 1);
  for (unsigned i = 0; i < trials(300); ++i) {
    const SphereVolume sphere{somewhere(random, 1), static_cast<float>(random.log_uniform(1e-3, 1))};
    Found expected;
    for (const ClosestPoint& point : try_all<float>(meshes, {sphere.center, sphere.radius}))
      expected.insert({point.geometry, point.primitive});
    REQUIRE(ask(scene.traced, sphere) == expected);
  }
}

TEST_CASE("a mesh's own triangles overlap their neighbours, and what touches overlaps") {
  const Mesh mesh = grid_plane(4, 2, 0.0f);
  const Scene scene = make_scene({mesh});
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const Corners c = corners(mesh, i);
    const Found found = ask(scene.traced, TriangleVolume{{vec3(c.p0), vec3(c.p1), vec3(c.p2)}});
    for (std::uint32_t k = 0; k < mesh.triangles.size(); ++k) {
      bool shares = false;
      for (const std::uint32_t a : mesh.triangles[i])
        for (const std::uint32_t b : mesh.triangles[k]) shares = shares || mesh.positions[a] == mesh.positions[b];
      if (shares) REQUIRE(found.count({0, k}) == 1);
    }
  }
  const Box on{{-1, -1, 0}, {1, 1, 5}}, above{{-1, -1, 0x1p-20f}, {1, 1, 5}}, empty{{1, 1, 1}, {-1, -1, -1}};
  REQUIRE(ask(scene.traced, on).size() == mesh.triangles.size());
  REQUIRE(ask(scene.traced, above).empty());
  REQUIRE(ask(scene.traced, empty).empty());
}

TEST_CASE("overlaps through instances are those of the placed triangles") {
  Random random(kSeed + 2);
  InstanceScene scene;
  const Mesh mesh = star(2, 3);
  scene.add_file({mesh}, NodeLayout::kPlanes);
  scene.groups.resize(2);
  for (std::uint32_t i = 0; i < 5; ++i) scene.groups[0].push_back({.object = 0, .to_scene = random_affine(random, 2)});
  for (std::uint32_t i = 0; i < 4; ++i)
    scene.groups[1].push_back({.object = i % 2, .to_scene = random_affine(random, 3), .mask = i == 3 ? 2u : 1u});
  scene.build();
  const SceneView view = scene.view();
  using P = Instanced<Policies, 2>;
  std::size_t found = 0;
  for (unsigned i = 0; i < trials(200); ++i) {
    const OrientedBox volume = random_oriented(random, 4, random.in_cube(4));
    const ConvexVolume hull = convex(volume);
    std::size_t expected = 0;
    const auto meet = [&](const std::vector<std::uint32_t>& path) {
      PlacedVertices<2> placed;
      ObjectView at(view);
      for (const std::uint32_t instance : path) {
        placed.enter(at.instances[instance]);
        at = ObjectView(view, view.objects[at.instances[instance].object]);
      }
      for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
        const Corners c = corners(mesh, k);
        const Vec3D corner[3] = {placed.to_scene(vec3d(c.p0)), placed.to_scene(vec3d(c.p1)),
                                 placed.to_scene(vec3d(c.p2))};
        expected += is_apart(hull, corner) ? 0 : 1;
      }
    };
    for (std::uint32_t outer = 0; outer < 3; ++outer)
      if (outer % 2 == 0)
        meet({outer});
      else
        for (std::uint32_t inner = 0; inner < 5; ++inner) meet({outer, inner});
    P::Stack::Memory memory;
    const auto take = [](const BasicOverlap<2>&) { return true; };
    const FoundCount count = overlaps<P>(view, volume, memory, take, {.mask = 1});
    INFO("seed " << kSeed + 2 << ", volume " << i);
    REQUIRE((count.state == TraversalState::kFinished && count.count == expected));
    found += expected;
  }
  REQUIRE(found > trials(100));
}

TEST_CASE("behind an instance a volume is compared with boxes as before it") {
  // The margin for rounding grows with the scene: some of these boxes are within it, some are beyond.
  const SceneView scene{.bounds = {{-0x1p19f, -0x1p19f, -0x1p19f}, {0x1p19f, 0x1p19f, 0x1p19f}}};
  const ConvexVolume volume = convex(OrientedBox{{0, 0, 0}, {{1, 1, 0}, {-1, 1, 0}, {0, 0, 1}}});
  VolumeRegion<ArrayLanes, 1> region(scene, volume);
  const auto met = [&] {
    std::set<unsigned> result;
    for (unsigned i = 0; i < 32; ++i) {
      const float corner = 1 + static_cast<float>(i) / 32;
      PlanesBoxNode node{};
      for (unsigned child = 0; child < kBranching; ++child)
        PlanesLayout::set_box(node, child, {{corner, corner, 0}, {3, 3, 1}});
      if (region.boxes(node).any()) result.insert(i);
    }
    return result;
  };
  const std::set<unsigned> before = met();
  CHECK((!before.empty() && before.size() < 32));
  InstanceRecord instance{};
  for (unsigned k = 0; k < 3; ++k) instance.linear[k][k] = 1.0f;
  ObjectRecord object{};
  object.bounds = {{-1, -1, -1}, {1, 1, 1}};
  region.enter(instance, object);
  region.leave();
  CHECK(met() == before);
}

TEST_CASE("queries for overlaps fail clearly, and stop when told") {
  const Scene half = make_scene({icosphere(1)}, {.nodes = NodeLayout::kHalf}), scene = make_scene({icosphere(3)});
  PrivateStack<>::Memory memory;
  const Box all{{-2, -2, -2}, {2, 2, 2}};
  REQUIRE(any_overlap<Policies>(half.traced, all, memory).failed());
  REQUIRE(any_overlap<Policies>(half.traced, SphereVolume{Vec3(0), 2}, memory).failed());
  unsigned calls = 0;
  const auto take = [&](const BasicOverlap<0>&) { return ++calls < 4; };
  REQUIRE((overlaps<Policies>(scene.traced, all, memory, take).state == TraversalState::kHit && calls == 4));
  struct SmallStack : Policies {
    using Stack = PrivateStack<4>;
  };
  PrivateStack<4>::Memory small;
  REQUIRE(overlaps<SmallStack>(scene.traced, all, small, take).failed());
}
