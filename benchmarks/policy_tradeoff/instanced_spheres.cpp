#include "instanced_spheres.h"

#include <tests/oracle/exact.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/random.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hiprt::bench {
namespace {

using build::Affine, build::Instance, build::Motion;
using oracle::Double3, oracle::Random;
using textbook::Real, textbook::Real3;

constexpr std::uint64_t kSeed = 20261123;

Real dot(const Real3& a, const Real3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Real3 minus(const Real3& a, const Real3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Real3 cross(const Real3& a, const Real3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Real3 real(const Vec3& v) { return {v.x, v.y, v.z}; }

/// The quaternion of a rotation.
void set_rotation(const Double3& axis, double angle, float (&rotation)[4]) {
  for (std::size_t k = 0; k < 3; ++k) rotation[k] = static_cast<float>(axis[k] * std::sin(0.5 * angle));
  rotation[3] = static_cast<float>(std::cos(0.5 * angle));
}

/// A random rotation, a translation of length @p distance, and a scale along the third axis.
Affine random_transform(Random& random, double distance, double scale) {
  build::MotionKey key;
  set_rotation(random.on_sphere(), random.uniform(0, 6.3), key.rotation);
  const Double3 away = random.on_sphere();
  for (std::size_t k = 0; k < 3; ++k) key.translation[k] = static_cast<float>(distance * away[k]);
  key.scale[2] = static_cast<float>(scale);
  return build::compose(key).to_scene;
}

Real3 times(const Affine& m, const Real3& p) {
  Real3 result;
  for (unsigned r = 0; r < 3; ++r)
    result[r] = Real{m.row[r][0]} * p[0] + Real{m.row[r][1]} * p[1] + Real{m.row[r][2]} * p[2] + Real{m.row[r][3]};
  return result;
}

/// Builds the file from groups of one instance each, the innermost first, and fills in the model.
build::Result<void> build_scene(InstancedSphere& sphere, double room) {
  const build::TriangleMesh mesh{.positions = sphere.mesh.positions, .triangles = sphere.mesh.triangles};
  const auto object = build::build({&mesh, 1});
  if (!object) return tl::unexpected(object.error());
  const std::span<const std::byte> files[] = {object->buffer.bytes()};
  std::vector<std::span<const Instance>> groups;
  for (const Instance& instance : sphere.chain) groups.emplace_back(&instance, 1);
  auto scene = build::build_instances(build::InstancedScene{files, groups});
  if (!scene) return tl::unexpected(scene.error());
  sphere.file = std::move(scene->buffer);

  sphere.model.name = sphere.name;
  sphere.model.mesh.triangles = sphere.mesh.triangles;
  const Real time = sphere.time;
  const Real3 centre = sphere.at({0, 0, 0}, time);
  sphere.model.centre =
      Vec3(static_cast<float>(centre[0]), static_cast<float>(centre[1]), static_cast<float>(centre[2]));
  Real nearest = std::numeric_limits<Real>::infinity(), farthest = 0;
  for (const build::Position& p : sphere.mesh.positions) {
    const Real3 at = sphere.at({p[0], p[1], p[2]}, time);
    sphere.model.mesh.positions.push_back(
        {static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2])});
    const Real3 from = minus(at, centre);
    nearest = std::min(nearest, std::sqrt(dot(from, from)));
    for (const Real x : from) farthest = std::max(farthest, std::fabs(x));
  }
  sphere.model.room = static_cast<float>(room * static_cast<double>(nearest));
  sphere.model.extent = static_cast<float>(farthest);
  return {};
}

build::Result<InstancedSphere> static_sphere(const char* name, unsigned levels, double distance, double scale) {
  Random random(kSeed);
  std::vector<Instance> chain(levels);
  for (unsigned level = 0; level < levels; ++level)
    chain[level] = {.object = level, .to_scene = random_transform(random, distance, scale)};
  InstancedSphere sphere;
  sphere.name = name;
  sphere.mesh = oracle::icosphere(4);
  sphere.at = [chain](Real3 p, Real) {
    for (const Instance& instance : chain) p = times(instance.to_scene, p);
    return p;
  };
  sphere.chain = std::move(chain);
  if (auto built = build_scene(sphere, 0.5); !built) return tl::unexpected(built.error());
  return sphere;
}

build::Result<InstancedSphere> moving_sphere(const char* name, MotionKind kind, double angle) {
  auto motion = std::make_unique<Motion>();
  motion->kind = kind;
  const Double3 axis{0, 0.6, 0.8};
  for (const float time : {0.0f, 1.0f}) {
    build::MotionKey key{.time = time, .translation = {3 - 2 * time, 2 * time, 1}};
    set_rotation(axis, angle * (double{time} - 0.5), key.rotation);
    for (float& scale : key.scale) scale = 1 + 0.5f * time;
    motion->keys.push_back(key);
  }
  InstancedSphere sphere;
  sphere.name = name;
  sphere.mesh = oracle::icosphere(4);
  sphere.time = 0.3f;
  sphere.at = [of = motion.get()](const Real3& p, Real time) { return textbook::moved(*of, time, p); };
  sphere.chain = {{.object = 0, .motion = motion.get()}};
  sphere.motions.push_back(std::move(motion));
  if (auto built = build_scene(sphere, 0.5); !built) return tl::unexpected(built.error());
  return sphere;
}

/// Intersection of a line and a triangle. The weights are in the order of the corners.
struct Met {
  Real t, weight[3];
};
Met meet(const Ray& ray, const Real3 (&corner)[3]) {
  const Real3 o = real(ray.origin), d = real(ray.direction);
  const Real3 a = minus(corner[0], o), b = minus(corner[1], o), c = minus(corner[2], o);
  const Real w[3] = {dot(d, cross(b, c)), dot(d, cross(c, a)), dot(d, cross(a, b))};
  const Real sum = w[0] + w[1] + w[2];
  const Real3 n = cross(minus(corner[1], corner[0]), minus(corner[2], corner[0]));
  return {dot(a, n) / dot(d, n), {w[0] / sum, w[1] / sum, w[2] / sum}};
}

void corners_at(const InstancedSphere& sphere, std::size_t triangle, Real time, Real3 (&corner)[3]) {
  for (std::size_t k = 0; k < 3; ++k) {
    const build::Position& p = sphere.mesh.positions[sphere.mesh.triangles[triangle][k]];
    corner[k] = sphere.at({p[0], p[1], p[2]}, time);
  }
}

}  // namespace

build::Result<std::vector<InstancedSphere>> make_instanced_spheres() {
  std::vector<InstancedSphere> spheres;
  const auto add = [&](build::Result<InstancedSphere> sphere) {
    if (sphere) spheres.push_back(std::move(*sphere));
    return sphere ? build::Result<void>() : tl::unexpected(sphere.error());
  };
  for (auto&& made : {add(static_sphere("1 level", 1, 1, 1)), add(static_sphere("1 level at 1e3", 1, 1e3, 1)),
                      add(static_sphere("1 level at 1e5", 1, 1e5, 1)), add(static_sphere("16 levels", 16, 1, 1)),
                      add(static_sphere("flat to 1e-3", 1, 1, 1e-3)),
                      add(moving_sphere("slerp, 170 degrees", MotionKind::kSlerp, 2.967)),
                      add(moving_sphere("nlerp, 170 degrees", MotionKind::kNlerp, 2.967)),
                      add(moving_sphere("matrices, 60 degrees", MotionKind::kMatrix, 1.047))})
    if (!made) return tl::unexpected(made.error());
  return spheres;
}

InstancedRays instanced_rays(const InstancedSphere& sphere, unsigned count) {
  InstancedRays result;
  Random random(kSeed);
  const auto triangles = static_cast<std::uint32_t>(sphere.mesh.triangles.size());
  while (result.rays.size() < count) {
    Ray ray;
    ray.time = sphere.motions.empty() ? 0.0f : random.uniform_float(0, 1);
    // From about the centre at that time through a triangle's inside: the one that the ray meets first, as the sphere
    // is convex.
    const std::uint32_t triangle = random.below(triangles);
    Real3 corner[3];
    corners_at(sphere, triangle, ray.time, corner);
    const Real3 centre = sphere.at({0, 0, 0}, ray.time);
    const Double3 away = random.on_sphere();
    const double reach = 0.5 * double{sphere.model.room} * random.unit();
    const Real u = random.unit(), v = (1 - u) * random.unit();
    Real3 target;
    for (std::size_t k = 0; k < 3; ++k) target[k] = (1 - u - v) * corner[0][k] + u * corner[1][k] + v * corner[2][k];
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      ray.origin[k] = static_cast<float>(centre[i] + reach * away[i]);
      ray.direction[k] = static_cast<float>(target[i] - ray.origin[k]);
    }
    const Met met = meet(ray, corner);
    if (!(std::min({met.weight[0], met.weight[1], met.weight[2]}) > 0) || !(met.t > 0)) continue;
    result.rays.push_back(ray);
    result.truths.push_back(static_cast<double>(met.t));
  }
  return result;
}

Errors measure_instanced(const InstancedSphere& sphere, const InstancedRays& instanced, std::span<const Hit> hits,
                         bool has_bounds) {
  Errors result;
  std::vector<double> t, point;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Ray& ray = instanced.rays[i];
    const Hit& hit = hits[i];
    const double truth = instanced.truths[i];
    ++result.rays;
    if (!hit.found()) {
      ++result.missed;
      continue;
    }
    if (!(std::abs(double{hit.t} - truth) <= 0.01 * truth)) {
      ++result.wrong;
      continue;
    }
    Real3 corner[3];
    corners_at(sphere, hit.primitive, ray.time, corner);
    const Met met = meet(ray, corner);
    t.push_back(static_cast<double>(std::fabs(hit.t - met.t)) / oracle::ulp(static_cast<double>(met.t)));
    const Vec3 at = spawn_detail::moved(ray.origin, hit.t, ray.direction);
    const Real3 n = cross(minus(corner[1], corner[0]), minus(corner[2], corner[0]));
    const auto off = static_cast<double>(std::fabs(dot(n, minus(real(at), corner[0]))) / std::sqrt(dot(n, n)));
    point.push_back(off / oracle::ulp(double{std::max(max_component(ray.origin), max_component(at))}));
    if (has_bounds && off > 1.7321 * double{hit.error}) ++result.beyond_bound;
  }
  result.t = spread(std::move(t));
  result.point = spread(std::move(point));
  return result;
}

}  // namespace hiprt::bench
