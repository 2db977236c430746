#pragma once
/// Custom primitives whose hits are exact in float: boxes with integer corners. Rays have integer origins and
/// directions whose components are powers of two or zero.

#include <hiprt_build/format/view.h>
#include <tests/oracle/random.h>
#include <tests/traversal/every_hit.h>

namespace hiprt::checks {

/// Reports where the ray enters the box and where it leaves it, in the whole of the line, whatever the range.
struct BoxSurface {
  std::span<const Box> boxes;
  bool leaves = true;  ///< Whether it has a far side.
  float odd = 0;       ///< Added to the t of odd primitives: infinity, NaN, or a shift out of the range.

  template <class Report> bool intersect(const Ray& ray, float, float, std::uint32_t primitive, Report&& report) const {
    const Box& box = boxes[primitive];
    float first = -std::numeric_limits<float>::infinity(), last = std::numeric_limits<float>::infinity();
    int first_axis = 0, last_axis = 0;
    for (int k = 0; k < 3; ++k) {
      const float low = box.min[k], high = box.max[k], o = ray.origin[k], d = ray.direction[k];
      if (d == 0) {
        if (o < low || o > high) return true;
        continue;
      }
      const float a = ((d > 0 ? low : high) - o) / d, b = ((d > 0 ? high : low) - o) / d;
      if (a > first) first_axis = k;
      if (b < last) last_axis = k;
      first = std::max(first, a);
      last = std::min(last, b);
    }
    if (first > last) return true;
    const float shift = primitive % 2 == 1 ? odd : 0;
    const auto normal = [&](int axis, float side) {
      Vec3 n(0);
      n[axis] = ray.direction[axis] > 0 ? side : -side;
      return n;
    };
    if (!report(CustomHit{first + shift, 0.25f, 0.0f, normal(first_axis, -1), 0.0f})) return false;
    return !leaves || report(CustomHit{last + shift, 0.75f, 0.0f, normal(last_axis, 1), 0.0f});
  }
};

/// A rectangle across z in the middle of the box. It finds the box by the full id, and its own filter rejects every
/// third primitive.
struct MiddlePlane {
  std::span<const std::span<const Box>> boxes_of_geometry;
  bool rejects = true;

  template <class Report> bool intersect(const Ray& ray, float, float, PrimitiveId id, Report&& report) const {
    const Box& box = boxes_of_geometry[id.geometry][id.primitive];
    if (ray.direction.z == 0) return true;
    const float t = ((box.min[2] + box.max[2]) / 2 - ray.origin.z) / ray.direction.z;
    for (int k = 0; k < 2; ++k) {
      const float at = ray.origin[k] + t * ray.direction[k];
      if (!(at >= box.min[k] && at <= box.max[k])) return true;
    }
    return report(CustomHit{t, 0, 1, Vec3(0, 0, 2), 0.5f});
  }
  FilterResult filter(const Ray&, const Hit& hit) const {
    return rejects && hit.primitive % 3 == 0 ? FilterResult::kReject : FilterResult::kAccept;
  }
};

/// Boxes with even corners in [-32, 32]^3, some of them flat.
inline std::vector<Box> integer_boxes(unsigned count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Box> boxes(count);
  for (Box& box : boxes)
    for (unsigned axis = 0; axis < 3; ++axis) {
      const float low = 2.0f * static_cast<float>(random.below(24)) - 24.0f;
      box.min[axis] = low;
      box.max[axis] = low + 2.0f * static_cast<float>(random.below(5));
    }
  return boxes;
}

/// From an integer point, in directions of 0, +-1/2, +-1, +-2.
inline Ray integer_ray(Random& random) {
  constexpr float kComponents[] = {0.0f, -0.0f, 0.5f, -0.5f, 1.0f, -1.0f, 2.0f, -2.0f};
  Ray ray;
  for (int k = 0; k < 3; ++k) {
    ray.origin[k] = static_cast<float>(random.below(65)) - 32.0f;
    ray.direction[k] = kComponents[random.below(8)];
  }
  if (random.below(4) == 0) ray.tmin = static_cast<float>(random.below(64)) / 2;
  if (random.below(4) == 0) ray.tmax = static_cast<float>(random.below(128)) / 2;
  if (random.below(4) == 0) ray.mask = 1u << random.below(3);
  return ray;
}

/// The input of a scene of meshes and custom geometries; the functors use it too.
struct CustomWorld {
  std::vector<Mesh> meshes;
  std::vector<std::vector<Box>> boxes;         ///< Per custom geometry.
  std::vector<build::CustomGeometry> customs;  ///< Of those boxes.
  std::vector<std::span<const Box>> boxes_of_geometry;

  void add(std::vector<Box> more, std::uint8_t type, std::uint32_t mask = 0xffffffffu) {
    boxes.push_back(std::move(more));
    customs.push_back({{}, type, mask});
    boxes_of_geometry.assign(meshes.size(), {});
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      customs[i].boxes = boxes[i];
      boxes_of_geometry.push_back(boxes[i]);
    }
  }

  Scene scene(const build::BuildOptions& options) const {
    const auto mesh_views = oracle::views(meshes);
    auto bvh = build::build(build::SceneInput{mesh_views, customs}, options);
    INFO((bvh ? "" : bvh.error().message));
    REQUIRE(bvh.has_value());
    Scene scene;
    scene.name = std::string(build::name(options.builder)) + " layout " +
                 std::to_string(static_cast<std::uint32_t>(options.nodes)) + " leaf " +
                 std::to_string(options.max_leaf_triangles);
    scene.bvh = std::move(*bvh);
    const auto view = open_buffer(std::as_const(scene.bvh.buffer).bytes());
    REQUIRE(view.has_value());
    scene.view = *view;
    scene.traced = make_scene_view(*view);
    return scene;
  }

  /// Asks the set about every primitive. @return all hits in the range that its filters let pass, sorted; two at the
  /// same t of one primitive in the order of its reports.
  template <class Primitives> std::vector<Hit> every_hit(const Ray& ray, const Primitives& primitives) const {
    std::vector<Hit> hits = checks::every_hit(meshes, ray);
    if (!is_traceable(ray)) return hits;
    for (std::uint32_t c = 0; c < customs.size(); ++c) {
      if ((customs[c].mask & ray.mask) == 0) continue;
      const auto geometry = static_cast<std::uint32_t>(meshes.size()) + c;
      for (std::uint32_t i = 0; i < boxes[c].size(); ++i)
        primitives.intersect(
            customs[c].type, ray, effective_tmin(ray), ray.tmax, PrimitiveId{geometry, i}, [&](const CustomHit& found) {
              const Hit hit{found.t, found.u, found.v, geometry, i, found.normal, found.error};
              if (in_range(ray, hit.t) && primitives.filter(customs[c].type, ray, hit) != FilterResult::kReject)
                hits.push_back(hit);
              return true;
            });
    }
    return sorted(std::move(hits));
  }
};

}  // namespace hiprt::checks
