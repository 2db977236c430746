// Rays in scenes of instances: what they hit does not depend on the trees over instances, on any number of levels.

#include <tests/traversal/instance_scenes.h>

#include <algorithm>
#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261122;

template <class LayoutType, unsigned kLevels> struct Tracer : Instanced<Policies<LayoutType>, kLevels> {};
template <class LayoutType, unsigned kLevels> struct PostponedTracer : Instanced<Policies<LayoutType>, kLevels> {
  using Schedule = Postponed;
};

Ray random_ray(Random& random, double spread) {
  Ray ray;
  const auto origin = random.in_cube(spread), target = random.in_cube(0.6 * spread);
  ray.origin = Vec3(origin[0], origin[1], origin[2]);
  ray.direction = Vec3(target[0], target[1], target[2]) - ray.origin;
  if (random.below(4) == 0) ray.tmax = random.uniform_float(0.2, 1.2);
  if (random.below(8) == 0) ray.mask = 2;
  return ray;
}

/// Groups of instances of what is before them.
InstanceScene random_scene(std::uint64_t seed, NodeLayout layout, unsigned levels, std::uint32_t instances) {
  Random random(seed);
  InstanceScene scene;
  scene.add_file({oracle::icosphere(2)}, layout);
  scene.add_file({oracle::soup(40, 0.5, seed), oracle::torus(12, 8, 0.4)}, layout);
  for (unsigned level = 0; level < levels; ++level) {
    std::vector<Instance> group(instances);
    for (std::uint32_t i = 0; i < instances; ++i) {
      // The group before at least once, so that there are as many levels.
      const auto objects = static_cast<std::uint32_t>(scene.files.size() + level);
      group[i] = {.object = i == 0 ? objects - 1 : random.below(objects),
                  .to_scene = random_affine(random, 3.0),
                  .mask = random.below(6) == 0 ? 2u : 0xffffffffu,
                  .id = 100 * level + i};
    }
    scene.groups.push_back(group);
  }
  return scene;
}

template <class P> void check_rays(const InstanceScene& scene, std::uint64_t seed, unsigned rays) {
  const SceneView view = scene.view();
  REQUIRE(covers<P>(view));
  EveryInstance<P> every(scene, view);
  Random random(seed);
  unsigned hits = 0;
  for (unsigned i = 0; i < rays; ++i) {
    const Ray ray = random_ray(random, 6.0);
    const auto expected = every.closest(ray);
    const auto hit = closest_hit<P>(view, ray);
    INFO("ray " << i << " of seed " << seed);
    REQUIRE_FALSE(hit.failed());
    REQUIRE(hit.found() == expected.found());
    REQUIRE(any_hit<P>(view, ray).found() == expected.found());
    if (!hit.found()) continue;
    ++hits;
    REQUIRE(hit.t == expected.t);
    REQUIRE(hit.u == expected.u);
    REQUIRE(hit.path == expected.path);
    REQUIRE(hit.geometry == expected.geometry);
    REQUIRE(hit.primitive == expected.primitive);
  }
  CHECK(hits > rays / 20);
}

}  // namespace

TEMPLATE_TEST_CASE("hits do not depend on trees over instances, in every layout", "", FloatLayout, PlanesLayout,
                   HalfLayout, QuantizedLayout) {
  for (unsigned levels = 1; levels <= 3; ++levels) {
    InstanceScene scene = random_scene(kSeed + levels, TestType::kId, levels, 9);
    scene.build();
    CHECK(scene.view().levels == levels);
    check_rays<Tracer<TestType, 3>>(scene, kSeed, 400);
    check_rays<PostponedTracer<TestType, 3>>(scene, kSeed + 1, 200);
  }
  InstanceScene scene = random_scene(kSeed, TestType::kId, 1, 30);
  scene.build();
  check_rays<Tracer<TestType, 1>>(scene, kSeed, 600);
  check_rays<PostponedTracer<TestType, 1>>(scene, kSeed, 300);
}

TEST_CASE("hits do not depend on how instances' boxes and trees are made") {
  for (const auto bounds : {build::InstanceBounds::kRoot, build::InstanceBounds::kChildren,
                            build::InstanceBounds::kGrandchildren, build::InstanceBounds::kPrimitives})
    for (const auto builder : {build::Builder::kSah, build::Builder::kLbvh, build::Builder::kHploc}) {
      InstanceScene scene = random_scene(kSeed, NodeLayout::kPlanes, 2, 12);
      scene.build({.tree = {.builder = builder}, .bounds = bounds});
      check_rays<Tracer<PlanesLayout, 2>>(scene, kSeed, 300);
    }
}

TEST_CASE("sixteen levels") {
  InstanceScene scene = random_scene(kSeed, NodeLayout::kPlanes, kMostLevels, 2);
  scene.build();
  CHECK(scene.view().levels == kMostLevels);
  CHECK_FALSE(covers<Tracer<PlanesLayout, kMostLevels - 1>>(scene.view()));
  CHECK(closest_hit<Tracer<PlanesLayout, kMostLevels - 1>>(scene.view(), Ray{}).failed());
  CHECK_FALSE(covers<Policies<>>(scene.view()));
}

namespace {

/// The exact closest hit, of the transforms and triangles as they stand in the file.
struct ExactHit {
  double t = std::numeric_limits<double>::infinity();
  double margin = 0.0;     ///< Of the smallest weight: near 0 the ray passes an edge.
  double steepness = 0.0;  ///< How far the ray gets from the triangle's plane, in the scene, per unit of t.
};

/// Woop and the like have no place here: the scalar triple products of Moller and Trumbore, in long double.
ExactHit exact_hit(const std::vector<const InstanceRecord*>& way, const oracle::Mesh& mesh, const Ray& ray) {
  using Real = long double;
  using Real3 = std::array<Real, 3>;
  const auto cross = [](const Real3& a, const Real3& b) {
    return Real3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const auto dot = [](const Real3& a, const Real3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  Real3 o{ray.origin.x, ray.origin.y, ray.origin.z}, d{ray.direction.x, ray.direction.y, ray.direction.z};
  for (const InstanceRecord* record : way) {
    Real3 inner_o{}, inner_d{};
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) {
        inner_o[r] += Real{record->linear[r][c]} * (o[c] - Real{record->translation[c]});
        inner_d[r] += Real{record->linear[r][c]} * d[c];
      }
    o = inner_o;
    d = inner_d;
  }
  ExactHit best;
  for (const oracle::Triangle& triangle : mesh.triangles) {
    Real3 p[3];
    for (unsigned k = 0; k < 3; ++k)
      for (unsigned axis = 0; axis < 3; ++axis) p[k][axis] = mesh.positions[triangle[k]][axis];
    Real3 e1, e2, s;
    for (unsigned axis = 0; axis < 3; ++axis) {
      e1[axis] = p[1][axis] - p[0][axis];
      e2[axis] = p[2][axis] - p[0][axis];
      s[axis] = o[axis] - p[0][axis];
    }
    const Real3 h = cross(d, e2), q = cross(s, e1);
    const Real determinant = dot(e1, h), u = dot(s, h) / determinant, v = dot(d, q) / determinant,
               t = dot(e2, q) / determinant;
    const Real margin = std::min({u, v, 1 - u - v});
    if (!(margin >= 0) || !(t >= 0) || !(t < best.t)) continue;
    Real3 normal = cross(e1, e2);
    const Real along = dot(normal, d);
    for (std::size_t i = way.size(); i-- > 0;) {
      Real3 outer{};
      for (unsigned r = 0; r < 3; ++r)
        for (unsigned c = 0; c < 3; ++c) outer[c] += Real{way[i]->linear[r][c]} * normal[r];
      normal = outer;
    }
    best = {static_cast<double>(t), static_cast<double>(margin),
            static_cast<double>(std::fabs(along) / std::sqrt(dot(normal, normal)))};
  }
  return best;
}

/// One instance in the other, @p levels of them, each this far from its scene's origin.
InstanceScene chain(std::uint64_t seed, unsigned levels, double translation, double stretch = 1.0) {
  Random random(seed);
  InstanceScene scene;
  scene.add_file({oracle::icosphere(3)}, NodeLayout::kPlanes);
  for (unsigned level = 0; level < levels; ++level) {
    const auto away = random.on_sphere();
    scene.groups.push_back(
        {{.object = level,
          .to_scene = affine(random.on_sphere(), random.uniform(0, 6.3), {1.0, 1.0, stretch},
                             {translation * away[0], translation * away[1], translation * away[2]})}});
  }
  scene.build();
  return scene;
}

/// Where the chain's innermost origin is in the scene.
Vec3 innermost(const InstanceScene& scene) {
  Vec3 p(0.0f);
  for (const auto& group : scene.groups) {
    const auto& m = group[0].to_scene.row;
    const auto row = [&](unsigned r) {
      return static_cast<float>(double{m[r][0]} * p.x + double{m[r][1]} * p.y + double{m[r][2]} * p.z + m[r][3]);
    };
    p = Vec3(row(0), row(1), row(2));
  }
  return p;
}

std::vector<const InstanceRecord*> way_of(const InstanceScene& scene, const SceneView& view) {
  InstancePath<kMostLevels> path;
  path.depth = static_cast<std::uint32_t>(scene.groups.size());
  std::vector<const InstanceRecord*> way;
  follow<false>(view, path, 0.0f, [&](const InstanceRecord& record, const ObjectRecord&, const MotionRecord*) {
    way.push_back(&record);
  });
  return way;
}

/// Rays from the scene at a sphere that may be far away: what is found, how exact t is, and whether the error bounds
/// hold. @return the median and the largest error of t in 2^-24 of it, and the largest part of a bound that is used up.
std::array<double, 3> check_exactness(const InstanceScene& scene, std::uint64_t seed, unsigned rays) {
  using P = Tracer<PlanesLayout, kMostLevels>;
  const SceneView view = scene.view();
  const auto way = way_of(scene, view);
  const oracle::Mesh mesh = oracle::icosphere(3);
  const Vec3 center = innermost(scene);
  Random random(seed);
  std::vector<double> errors;
  double tightest = 0.0;
  for (unsigned i = 0; i < rays; ++i) {
    const auto from = random.on_sphere();
    const auto at = random.in_cube(0.7);
    const auto away = random.uniform_float(3, 10);
    Ray ray;
    ray.origin = center + away * Vec3(from[0], from[1], from[2]);
    ray.direction = center + Vec3(at[0], at[1], at[2]) - ray.origin;
    const ExactHit exact = exact_hit(way, mesh, ray);
    const auto hit = closest_hit<P>(view, ray);
    // Another facet at an edge, which the rounded ray passes on the other side, lies in the same place but for that.
    if (exact.margin < 1e-3) continue;
    INFO("ray " << i << ", exact t " << exact.t);
    REQUIRE(hit.found());
    const double distance = std::fabs(double{hit.t} - exact.t);
    REQUIRE(distance * exact.steepness <= 1.7321 * double{hit.error});
    tightest = std::max(tightest, distance * exact.steepness / double{hit.error});
    errors.push_back(distance / exact.t * 0x1p24);
  }
  REQUIRE(errors.size() > rays / 3);
  std::sort(errors.begin(), errors.end());
  return std::array{errors[errors.size() / 2], errors.back(), tightest};
}

}  // namespace

TEST_CASE("t is exact far from the origin, on many levels and through uneven scales") {
  const auto report = [](const char* what, const std::array<double, 3>& errors) {
    std::printf("error of t, in 2^-24 of it: %-28s median %6.2f, largest %6.1f; of the bound %.4f\n", what, errors[0],
                errors[1], errors[2]);
    return errors[0];
  };
  CHECK(report("translation 1", check_exactness(chain(kSeed, 1, 1), kSeed, 2000)) < 1);
  CHECK(report("translation 1e3", check_exactness(chain(kSeed, 1, 1e3), kSeed, 2000)) < 1);
  CHECK(report("translation 1e5", check_exactness(chain(kSeed, 1, 1e5), kSeed, 2000)) < 1);
  CHECK(report("16 levels, 1 each", check_exactness(chain(kSeed, 16, 1), kSeed, 2000)) < 12);
  CHECK(report("scale 1e-3 along an axis", check_exactness(chain(kSeed, 1, 1, 1e-3), kSeed, 2000)) < 50);
}

TEST_CASE("transforms that cannot be are refused with their numbers") {
  const auto message_of = [](const Affine& transform) {
    InstanceScene scene;
    scene.add_file({oracle::icosphere(1)}, NodeLayout::kPlanes);
    scene.groups.push_back({{}, {.to_scene = transform}});
    const auto bvh = scene.try_build();
    if (bvh) return std::string();
    CHECK(bvh.error().code == build::ErrorCode::kInvalidInput);
    return bvh.error().message;
  };
  const auto diagonal = [](float x, float y, float z) { return Affine{{{x, 0, 0, 0}, {0, y, 0, 0}, {0, 0, z, 0}}}; };
  const float inf = std::numeric_limits<float>::infinity();
  CHECK(message_of(diagonal(1, 1, 0)) ==
        "group 0, instance 1: the transform has no inverse that floats can hold: determinant 0");
  CHECK(message_of(diagonal(1, 1, 1e-39f)).find("determinant 1e-39") != std::string::npos);
  CHECK(message_of({{{1, 2, 3, 0}, {4, 5, 6, 0}, {7, 8, 9, 0}}}).find("determinant 0") != std::string::npos);
  CHECK(message_of(diagonal(1, inf, 1)) == "group 0, instance 1: the transform is not finite");
  Affine moved;
  moved.row[2][3] = std::numeric_limits<float>::quiet_NaN();
  CHECK(message_of(moved) == "group 0, instance 1: the transform is not finite");
  // Small, large, mirrored, flat, sheared: all work.
  CHECK(message_of(diagonal(1e-10f, 1e-10f, 1e-10f)) == "");
  CHECK(message_of(diagonal(1e12f, 1e12f, 1e12f)) == "");
  CHECK(message_of(diagonal(-1, 1, 1)) == "");
  CHECK(message_of(diagonal(1, 1, 1e-6f)) == "");
  CHECK(message_of({{{1, 1000, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}}) == "");
}

TEST_CASE("what cannot be a scene is refused") {
  InstanceScene scene;
  const auto message = [&] {
    const auto bvh = scene.try_build();
    return bvh ? std::string() : bvh.error().message;
  };
  CHECK(message() == "a scene of instances has a group at least");
  scene.groups = {{{.object = 0}}};
  CHECK(message() == "group 0, instance 0: object 0, those before the group are 0");
  scene.add_file({oracle::icosphere(1)}, NodeLayout::kPlanes);
  scene.add_file({oracle::icosphere(1)}, NodeLayout::kFloat);
  CHECK(message() == "file 1: layout 1, that of file 0 is 2");
  scene.files.pop_back();
  scene.groups = {{{.object = 1}}};
  CHECK(message() == "group 0, instance 0: object 1, those before the group are 1");
  scene.groups = {{{.object = 0}}};
  scene.build();
  scene.files[0] = std::move(scene.file);
  CHECK(message() == "file 0: has instances itself: give its objects and groups in place of it");
}

TEST_CASE("scenes of nothing") {
  InstanceScene scene;
  scene.add_file({}, NodeLayout::kPlanes);
  scene.groups = {{}, {{.object = 0}, {.object = 1}}};
  scene.build();
  CHECK_FALSE(closest_hit<Tracer<PlanesLayout, 2>>(scene.view(), Ray{}).found());
  CHECK_FALSE(closest_hit<Tracer<PlanesLayout, 2>>(scene.view(), Ray{}).failed());
  scene.files.clear();
  scene.groups = {{}};
  scene.build();
  CHECK_FALSE(closest_hit<Tracer<PlanesLayout, 1>>(scene.view(), Ray{}).found());
}

TEST_CASE("all hits of a ray through instances, each once") {
  const InstanceScene scene = [] {
    InstanceScene made = random_scene(kSeed, NodeLayout::kPlanes, 2, 6);
    made.build();
    return made;
  }();
  using P = Tracer<PlanesLayout, 2>;
  const SceneView view = scene.view();
  Random random(kSeed);
  std::size_t most = 0;
  for (unsigned i = 0; i < 300; ++i) {
    const Ray ray = random_ray(random, 6.0);
    P::Stack::Memory memory, other;
    AllHits<P> all(view, ray, P::Stack::Storage(memory));
    ClosestHit<P> closest(view, ray, P::Stack::Storage(other));
    std::vector<PathHit<2>> in_any_order, in_order;
    for (auto hit = all.next_hit(); hit.found(); hit = all.next_hit()) in_any_order.push_back(hit);
    for (auto hit = closest.next_hit(); hit.found(); hit = closest.next_hit()) in_order.push_back(hit);
    REQUIRE(in_any_order.size() == in_order.size());
    most = std::max(most, in_order.size());
    const auto before = [](const PathHit<2>& a, const PathHit<2>& b) {
      if (a.t != b.t) return a.t < b.t;
      if (!(a.path == b.path)) return a.path < b.path;
      return std::pair(a.geometry, a.primitive) < std::pair(b.geometry, b.primitive);
    };
    std::sort(in_any_order.begin(), in_any_order.end(), before);
    for (std::size_t k = 0; k < in_order.size(); ++k) {
      REQUIRE(in_any_order[k].t == in_order[k].t);
      REQUIRE(in_any_order[k].path == in_order[k].path);
      REQUIRE(in_any_order[k].primitive == in_order[k].primitive);
      if (k > 0) REQUIRE(before(in_order[k - 1], in_order[k]));
    }
  }
  CHECK(most > 5);
}

TEST_CASE("rays that start on a surface seen through instances do not meet it again") {
  for (const double translation : {1.0, 1e3, 1e5}) {
    const InstanceScene scene = chain(kSeed + 1, 2, translation);
    using P = Tracer<PlanesLayout, 2>;
    const SceneView view = scene.view();
    const Vec3 center = innermost(scene);
    Random random(kSeed);
    unsigned spawned = 0;
    for (unsigned i = 0; i < 5000; ++i) {
      const auto from = random.on_sphere(), out = random.on_sphere();
      const auto at = random.in_cube(0.6);
      Ray ray;
      ray.origin = center + 4.0f * Vec3(from[0], from[1], from[2]);
      ray.direction = center + Vec3(at[0], at[1], at[2]) - ray.origin;
      const auto hit = closest_hit<P>(view, ray);
      if (!hit.found()) continue;
      Ray next;
      next.direction = Vec3(out[0], out[1], out[2]);
      if (glm::dot(next.direction, hit.normal) < 0) next.direction = -next.direction;
      next.origin = spawn_origin(ray, hit, next.direction);
      // Outside a ball there is nothing.
      REQUIRE(glm::dot(ray.direction, hit.normal) < 0);
      REQUIRE_FALSE(closest_hit<P>(view, next).found());
      ++spawned;
    }
    CHECK(spawned > 2000);
  }
}

TEST_CASE("builds of scenes tell how far they are, can be cancelled, and give the same bytes again") {
  const InstanceScene scene = random_scene(kSeed, NodeLayout::kPlanes, 3, 400);
  std::vector<double> fractions;
  build::InstanceOptions options;
  options.tree.progress = [&](const build::Progress& progress) {
    fractions.push_back(progress.fraction);
    return true;
  };
  const auto first = scene.try_build(options), second = scene.try_build({});
  REQUIRE(first.has_value());
  REQUIRE(second.has_value());
  CHECK(std::equal(first->buffer.bytes().begin(), first->buffer.bytes().end(), second->buffer.bytes().begin(),
                   second->buffer.bytes().end()));
  CHECK(std::is_sorted(fractions.begin(), fractions.end()));
  CHECK(first->statistics.customs == 400);
  for (const unsigned calls : {0u, 3u, 10u}) {
    unsigned left = calls;
    options.tree.progress = [&](const build::Progress&) { return left-- > 0; };
    const auto cancelled = scene.try_build(options);
    if (!cancelled) CHECK(cancelled.error().code == build::ErrorCode::kCancelled);
  }
  options.tree.progress = [](const build::Progress&) { return false; };
  REQUIRE_FALSE(scene.try_build(options).has_value());
}

TEST_CASE("bounds beyond floats are refused") {
  InstanceScene scene;
  scene.add_file({oracle::placed(oracle::icosphere(1), 1e30)}, NodeLayout::kPlanes);
  scene.groups = {{{.to_scene = {{{1e12f, 0, 0, 0}, {0, 1e12f, 0, 0}, {0, 0, 1e12f, 0}}}}}};
  const auto bvh = scene.try_build();
  REQUIRE_FALSE(bvh.has_value());
  CHECK(bvh.error().message == "group 0, instance 0: its bounds are beyond what floats hold");
}

TEST_CASE("an identity instance is the scene itself, with numbers at their limits too") {
  INFO("seed " << kSeed);
  InstanceScene scene;
  scene.add_file({oracle::torture(2000, kSeed), oracle::needles(500, 1e6, kSeed)}, NodeLayout::kPlanes);
  scene.groups = {{{}}};
  scene.build();
  const SceneView flat = make_scene_view(*open_buffer(scene.files[0].bytes())), view = scene.view();
  Random random(kSeed);
  unsigned hits = 0;
  for (unsigned i = 0; i < 4000; ++i) {
    Ray ray = random_ray(random, 2.0);
    ray.direction *= static_cast<float>(random.log_uniform(1e-20, 1e20));
    ray.tmax = std::numeric_limits<float>::infinity();
    const Hit expected = closest_hit<Policies<>>(flat, ray);
    const auto hit = closest_hit<Tracer<PlanesLayout, 1>>(view, ray);
    INFO("ray " << i);
    REQUIRE(hit.found() == expected.found());
    REQUIRE((!hit.found() || (hit.t == expected.t && hit.primitive == expected.primitive)));
    hits += hit.found() ? 1 : 0;
  }
  CHECK(hits > 100);
}
