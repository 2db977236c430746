#pragma once
/// Scenes of instances, and the hits of a ray by a loop over all instances.

#include <hiprt_build/format/validate.h>
#include <hiprt_build/instances.h>
#include <hiprt_device/format/widened_boxes.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/catch.h>

#include <string>
#include <vector>

namespace hiprt::checks {

using build::Affine;
using build::Instance;

constexpr unsigned kMostLevels = 16;

/// Rows of a rotation about an axis, times a scale per axis before it, and a translation.
inline Affine affine(const oracle::Double3& axis, double angle, const oracle::Double3& scale,
                     const oracle::Double3& translation) {
  const double c = std::cos(angle), s = std::sin(angle);
  Affine result;
  for (unsigned row = 0; row < 3; ++row) {
    for (unsigned column = 0; column < 3; ++column) {
      const double cross = row == column ? 0.0 : ((column + 3 - row) % 3 == 1 ? -1.0 : 1.0) * axis[3 - row - column];
      const double rotation = axis[row] * axis[column] * (1 - c) + (row == column ? c : 0.0) + s * cross;
      result.row[row][column] = static_cast<float>(rotation * scale[column]);
    }
    result.row[row][3] = static_cast<float>(translation[row]);
  }
  return result;
}

/// Any: turned, mirrored at times, scaled unevenly, sheared.
inline Affine random_affine(oracle::Random& random, double spread) {
  const oracle::Double3 scale{random.log_uniform(0.3, 3) * (random.below(4) == 0 ? -1 : 1), random.log_uniform(0.3, 3),
                              random.log_uniform(0.3, 3)};
  Affine result =
      affine(random.on_sphere(), random.uniform(0, 6.3), scale,
             {random.uniform(-spread, spread), random.uniform(-spread, spread), random.uniform(-spread, spread)});
  if (random.below(3) == 0)
    for (unsigned row = 0; row < 3; ++row) result.row[row][0] += 0.7f * result.row[row][1];
  return result;
}

/// A scene with everything that it is made of.
struct InstanceScene {
  std::vector<build::Buffer> files;
  std::vector<std::vector<Instance>> groups;
  build::Buffer file;

  void add_file(const std::vector<oracle::Mesh>& meshes, NodeLayout layout) {
    auto bvh =
        build::build(oracle::views(meshes),
                     {.builder = build::Builder::kHploc, .nodes = layout, .widen_boxes = may_be_widened(layout)});
    REQUIRE(bvh.has_value());
    files.push_back(std::move(bvh->buffer));
  }

  build::Result<build::Bvh> try_build(const build::InstanceOptions& options = {}) const {
    std::vector<std::span<const std::byte>> file_spans;
    for (const build::Buffer& object : files) file_spans.push_back(object.bytes());
    const std::vector<std::span<const Instance>> group_spans(groups.begin(), groups.end());
    return build::build_instances(build::InstancedScene{file_spans, group_spans}, options);
  }
  /// And checks the file.
  void build(const build::InstanceOptions& options = {}) {
    auto bvh = try_build(options);
    INFO((bvh ? std::string() : bvh.error().message));
    REQUIRE(bvh.has_value());
    file = std::move(bvh->buffer);
    const auto summary = validate(file.bytes());
    INFO((summary ? std::string() : to_string(summary.error())));
    REQUIRE(summary.has_value());
  }

  SceneView view() const { return make_scene_view(*open_buffer(file.bytes())); }

  /// Calls visit(file, the ray in its space) for every instance path of at most two levels to a file.
  template <class Visit> void for_each_path(const SceneView& of, const Ray& ray, Visit&& visit) const {
    follow_all(of, groups.size() - 1, {}, ray, visit);
  }

 private:
  template <class Visit>
  void follow_all(const SceneView& of, std::size_t group, InstancePath<2> path, const Ray& ray, Visit& visit) const {
    for (std::uint32_t i = 0; i < groups[group].size(); ++i) {
      path.instance[path.depth++] = i;
      const std::uint32_t object = groups[group][i].object;
      if (object >= files.size()) {
        follow_all(of, object - files.size(), path, ray, visit);
      } else {
        Ray local = ray;
        follow(of, path, ray.time, [&](const InstanceRecord& record, const ObjectRecord&, const MotionRecord*) {
          local = ray_to_object(record, local);
        });
        visit(object, local);
      }
      --path.depth;
    }
  }
};

/// The closest hit by a loop over all instances, without the trees over instances. The library transforms the rays.
template <class P> class EveryInstance {
 public:
  using Real = typename P::Real;
  using Result = BasicPathHit<Real, P::kLevels>;
  struct Flat : P {
    static constexpr unsigned kLevels = 0;
  };

  EveryInstance(const InstanceScene& scene, const SceneView& view) : scene_(scene), view_(view) {}

  Result closest(const BasicRay<Real>& ray) {
    best_ = {};
    path_ = {};
    best_.t = ray.tmax;
    search(scene_.groups.size() - 1, ray, ray);
    if (!best_.found()) best_.t = std::numeric_limits<Real>::infinity();
    return best_;
  }

 private:
  void search(std::size_t group, const BasicRay<Real>& local, const BasicRay<Real>& ray) {
    const ObjectView object =
        follow(view_, path_, ray.time, [](const InstanceRecord&, const ObjectRecord&, const MotionRecord*) {});
    for (std::uint32_t i = 0; i < scene_.groups[group].size(); ++i) {
      const Instance& instance = scene_.groups[group][i];
      if ((instance.mask & ray.mask) == 0) continue;
      path_.instance[path_.depth++] = i;
      BasicRay<Real> inner = ray_to_object(object.instance<true>(i, ray.time), local);
      inner.tmax = best_.t;
      if (instance.object < scene_.files.size())
        meet(scene_.files[instance.object], inner);
      else
        search(instance.object - scene_.files.size(), inner, ray);
      path_.instance[--path_.depth] = 0;
    }
  }

  void meet(const build::Buffer& file, const BasicRay<Real>& local) {
    const BasicHit<Real> hit = closest_hit<Flat>(make_scene_view(*open_buffer(file.bytes())), local);
    if (!hit.found() || (best_.found() && hit.t >= best_.t)) return;
    static_cast<BasicHit<Real>&>(best_) = hit;
    best_.path = path_;
  }

  const InstanceScene& scene_;
  const SceneView& view_;
  InstancePath<P::kLevels> path_{};
  Result best_{};
};

/// Through a cube of half the edge @p spread, at any time about [-3, 4).
inline Ray random_ray(oracle::Random& random, double spread) {
  Ray ray;
  const auto origin = random.in_cube(spread), target = random.in_cube(0.6 * spread);
  ray.origin = Vec3(origin[0], origin[1], origin[2]);
  ray.direction = Vec3(target[0], target[1], target[2]) - ray.origin;
  ray.time = random.uniform_float(-3, 4);
  if (random.below(4) == 0) ray.tmax = random.uniform_float(0.2, 1.2);
  if (random.below(8) == 0) ray.mask = 2;
  return ray;
}

/// Hits by the trees over instances are those of every instance tried, to the last bit.
template <class P> void check_rays(const InstanceScene& scene, std::uint64_t seed, unsigned rays) {
  const SceneView view = scene.view();
  REQUIRE(covers<P>(view));
  EveryInstance<P> every(scene, view);
  oracle::Random random(seed);
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

}  // namespace hiprt::checks
