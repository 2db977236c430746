// Instances whose transforms magnify rounding up to the accepted limit, and beyond it. The limit is 2^40. Up to 2^20 it
// applies to the condition number. Above that it applies to a bound that is 3 to 9 times as large.

#include <hiprt_build/format/view.h>
#include <hiprt_device/intersect/exact_triangle_test.h>
#include <hiprt_device/query/double_rays.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/instances/instance_scenes.h>
#include <tests/traversal/workers.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261126;

struct Exact : Policies {
  using Triangle = Reference;
};

/// For the object alone.
template <class P> struct FlatOf : P { static constexpr unsigned kLevels = 0; };

struct Case {
  std::string name;
  Affine transform;
  double condition;  ///< Longest over shortest image of a unit vector.
};

Affine diagonal(double x, double y, double z) {
  Affine result;
  for (std::size_t k = 0; k < 3; ++k) result.row[k][k] = static_cast<float>(std::array{x, y, z}[k]);
  return result;
}
/// x is moved by y times so much. The condition is its square, and a little.
Affine sheared(double by) {
  Affine result;
  result.row[0][1] = static_cast<float>(by);
  return result;
}
double condition_of_shear(double by) {
  const double stretch = 0.5 * (by + std::sqrt(by * by + 4));
  return stretch * stretch;
}
/// x is moved by y times b, then y by x: condition (b^2 + 2)^2, and unlike of the others a transform's rounding is as
/// much larger than the scene's. @param b with b^2 + 1 a float.
Affine sheared_twice(double b) {
  Affine result;
  result.row[0][0] = static_cast<float>(b * b + 1);
  result.row[0][1] = result.row[1][0] = static_cast<float>(b);
  return result;
}
/// A cyclic change of axes, behind the transform.
Affine turned(const Affine& of, unsigned by) {
  Affine result = of;
  for (unsigned row = 0; row < 3; ++row)
    for (unsigned column = 0; column < 3; ++column) result.row[row][column] = of.row[(row + by) % 3][column];
  return result;
}

/// Powers of two, so that records hold the inverses exactly, and any others.
std::vector<Case> cases() {
  std::vector<Case> result;
  for (const double exponent : {30.0, 35.5, 36.8, 38.4}) {
    const double c = std::exp2(exponent), root = std::sqrt(c), text = exponent;
    const std::string of = " of condition 2^" + std::to_string(text);
    result.push_back({"flat" + of, diagonal(1, 1, 1 / c), c});
    result.push_back({"a rod" + of, diagonal(root, 1 / root, 1 / root), c});
    result.push_back({"three scales" + of, turned(diagonal(-root, 1, 1 / root), 1), c});
    result.push_back({"sheared" + of, turned(sheared(root * (1 - 1 / c)), 2), condition_of_shear(root)});
  }
  for (const double b : {181.0, 512.0, 768.0}) {
    const double c = (b * b + 2) * (b * b + 2);
    result.push_back({"sheared twice, of condition 2^" + std::to_string(std::log2(c)), sheared_twice(b), c});
  }
  return result;
}

/// One instance of a mesh, and another with the same transform that no ray sees: a root of one leaf would have no boxes
/// to test.
InstanceScene scene_of(const Mesh& mesh, NodeLayout layout, const Affine& transform) {
  InstanceScene scene;
  scene.add_file({mesh}, layout);
  scene.groups.push_back({{.object = 0, .to_scene = transform}, {.object = 0, .to_scene = transform, .mask = 0}});
  return scene;
}

/// A point of the object where the record has it in the scene, to double's rounding.
Vec3D out_of(const InstanceRecord& record, const Double3& p) { return point_to_scene(record, Vec3D(p[0], p[1], p[2])); }

/// Origin and direction rounded once each. By convert(), as g++ 12 may forget the rounding of a cast (nearest_float()).
template <class Real> BasicRay<Real> ray_towards(const Vec3D& from, const Vec3D& to) {
  RayD ray;
  ray.origin = from;
  ray.origin = convert<double>(convert<Real>(ray)).origin;
  ray.direction = to - ray.origin;
  return convert<Real>(ray);
}

/// Rays from inside at edges, corners and interiors do not leak. The transform of a ray may move its origin by more
/// than the object's size: only rays whose origins stay inside in object space count.
/// @return how many were traced.
template <class P> unsigned check_no_leak(const std::string& name, const Closed& closed, const InstanceScene& scene) {
  using Real = typename P::Real;
  const SceneView view = scene.view();
  REQUIRE(covers<P>(view));
  const InstanceRecord& record = view.instances[0];
  Random random(kSeed);
  unsigned traced = 0;
  for (unsigned i = 0; i < trials(1200); ++i) {
    const Double3 center = closed.centers[i % closed.centers.size()], target = target_point(closed.mesh, random);
    const Double3 aside = random.on_sphere();
    Double3 start;
    for (std::size_t k = 0; k < 3; ++k) start[k] = center[k] + 0.5 * closed.inner_radius * aside[k];
    const BasicRay<Real> ray = ray_towards<Real>(out_of(record, start), out_of(record, target));
    const BasicRay<Real> local = ray_to_object(record, ray);
    double square = 0;
    for (int k = 0; k < 3; ++k) {
      const double off = static_cast<double>(local.origin[k]) - center[static_cast<std::size_t>(k)];
      square += off * off;
    }
    if (!(std::sqrt(square) < 0.99 * closed.inner_radius) || !(max_component(local.direction) > Real(0))) continue;
    ++traced;
    INFO(name << ", " << closed.name << ", ray " << i << " of seed " << kSeed);
    const auto hit = closest_hit<P>(view, ray);
    REQUIRE(hit.found());
    REQUIRE(any_hit<P>(view, ray).found());
    REQUIRE(std::isfinite(hit.t));
    REQUIRE(hit.error < std::numeric_limits<float>::infinity());
    // The tree over instances hides nothing, and the hit is that of the ray as the object sees it.
    const auto expected = closest_hit<FlatOf<P>>(make_scene_view(*open_buffer(scene.files[0].bytes())), local);
    REQUIRE((hit.t == expected.t && hit.u == expected.u && hit.v == expected.v));
    REQUIRE(hit.primitive == expected.primitive);
  }
  return traced;
}

/// A vertex that is the farthest along an axis, moved a little in or out: a corner of the object's bounds, about.
Double3 extreme_point(const Mesh& mesh, Random& random) {
  const std::size_t axis = random.below(3);
  const float side = random.coin() ? 1.0f : -1.0f;
  const Position& p =
      *std::max_element(mesh.positions.begin(), mesh.positions.end(),
                        [&](const Position& a, const Position& b) { return side * a[axis] < side * b[axis]; });
  const double by = 1 + random.uniform(-1, 1) * random.log_uniform(0x1p-12, 0x1p-3);
  return {by * p[0], by * p[1], by * p[2]};
}

/// Rays from outside, past the object and at it, hit what the transformed rays hit in the object alone. When rounding
/// moves a ray onto the object, the tree over instances must not reject it. @return how many hit.
template <class P> unsigned check_as_object(const std::string& name, const Closed& closed, const InstanceScene& scene) {
  using Real = typename P::Real;
  const SceneView view = scene.view();
  const SceneView object = make_scene_view(*open_buffer(scene.files[0].bytes()));
  Random random(kSeed + 1);
  unsigned hits = 0;
  for (unsigned i = 0; i < trials(3000); ++i) {
    const double radius = random.log_uniform(0.5, 16);
    const Double3 direction = random.on_sphere(),
                  beside{radius * direction[0], radius * direction[1], radius * direction[2]};
    const Vec3D target = out_of(view.instances[0], i % 4 == 0 ? beside : extreme_point(closed.mesh, random));
    Vec3D from(0);
    for (int k = 0; k < 3; ++k) {
      const double low = view.bounds.min[k], half = 0.5 * (view.bounds.max[k] - low);
      from[k] = low + half + half * random.uniform(-3, 3);
    }
    const BasicRay<Real> ray = ray_towards<Real>(from, target);
    const BasicRay<Real> local = ray_to_object(view.instances[0], ray);
    const auto expected = closest_hit<FlatOf<P>>(object, local);
    const auto hit = closest_hit<P>(view, ray);
    INFO(name << ", ray " << i << " of seed " << kSeed + 1);
    REQUIRE_FALSE(hit.failed());
    REQUIRE(hit.found() == expected.found());
    REQUIRE(any_hit<P>(view, ray).found() == expected.found());
    if (!hit.found()) continue;
    ++hits;
    REQUIRE((hit.t == expected.t && hit.u == expected.u && hit.v == expected.v));
    REQUIRE(hit.primitive == expected.primitive);
  }
  return hits;
}

std::vector<Closed> shapes() {
  std::vector<Closed> result = closed_meshes();
  std::erase_if(result,
                [](const Closed& closed) { return closed.mesh.triangles.size() > 4000 || closed.inner_radius < 0.1; });
  return result;
}

}  // namespace

TEST_CASE("closed meshes in instances of a condition up to 2^38 do not leak", "[extremes]") {
  const std::vector<Closed> closed = shapes();
  REQUIRE(closed.size() >= 2);
  const std::vector<Case> all = cases();
  unsigned traced[3] = {}, hits[3] = {};
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Closed& shape = closed[i % closed.size()];
    InstanceScene scene = scene_of(shape.mesh, NodeLayout::kPlanes, all[i].transform);
    INFO(all[i].name);
    scene.build();
    const double found = open_buffer(scene.file.bytes())->header->condition;
    CHECK(found >= all[i].condition * (1 - 1e-3));
    CHECK(found <= 9 * all[i].condition * (1 + 1e-3));
    traced[0] += check_no_leak<Instanced<Policies>>(all[i].name + ", default", shape, scene);
    traced[1] += check_no_leak<Instanced<Exact>>(all[i].name + ", Reference", shape, scene);
    traced[2] += check_no_leak<Instanced<DoubleRays<>>>(all[i].name + ", double", shape, scene);
    hits[0] += check_as_object<Instanced<Policies>>(all[i].name + ", default", shape, scene);
    hits[1] += check_as_object<Instanced<Exact>>(all[i].name + ", Reference", shape, scene);
    hits[2] += check_as_object<Instanced<DoubleRays<>>>(all[i].name + ", double", shape, scene);
  }
  std::printf(
      "condition to 2^38.4: default, Reference, double: %u, %u, %u rays from inside; of others %u, %u, %u hit\n",
      traced[0], traced[1], traced[2], hits[0], hits[1], hits[2]);
  const auto rays = static_cast<unsigned>(all.size()) * trials(1200);
  for (const unsigned count : traced) CHECK(count > rays / 2);
  for (const unsigned count : hits) CHECK(count > rays / 20);
}

TEST_CASE("a condition beyond 2^40 is refused with the determinant", "[extremes]") {
  const Mesh mesh = icosphere(1);
  const auto message_of = [&](const Affine& transform) {
    const auto bvh = scene_of(mesh, NodeLayout::kPlanes, transform).try_build();
    if (bvh) return std::string();
    CHECK(bvh.error().code == build::ErrorCode::kInvalidInput);
    return bvh.error().message;
  };
  for (unsigned by = 0; by < 3; ++by)
    for (const int exponent : {36, 41, 45, 60}) {
      const double c = std::exp2(exponent), root = std::sqrt(c);
      for (const Case& it : {Case{"flat", diagonal(1, 1, 1 / c), c}, Case{"a rod", diagonal(root, 1, 1), root},
                             Case{"three scales", diagonal(root, 1, 1 / root), c},
                             Case{"sheared", sheared(root * 1.01), condition_of_shear(root * 1.01)}}) {
        INFO(it.name << ", 2^" << exponent << ", axes " << by);
        const std::string message = message_of(turned(it.transform, by));
        if (9 * it.condition <= 0x1p40) {
          CHECK(message == "");
          continue;
        }
        if (it.condition <= 0x1p40) continue;
        const std::string fault =
                              "group 0, instance 0: the transform has no inverse that floats can hold: determinant ",
                          behind = ", condition ";
        REQUIRE(message.find(fault) == 0);
        const double determinant = it.name == "flat" ? 1 / c : 1.0;
        CHECK(std::stod(message.substr(fault.size())) == Approx(determinant).epsilon(1e-3).margin(0));
        const std::size_t at = message.find(behind);
        REQUIRE(at != std::string::npos);
        const double condition = std::stod(message.substr(at + behind.size()));
        CHECK(condition >= it.condition * (1 - 1e-3));
        CHECK(condition <= 9 * it.condition * (1 + 1e-3));
      }
    }
}
