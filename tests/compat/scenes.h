#pragma once
/// Random scenes for HIPRT's traversals, and all their hits by the queries of this library.

#include <hiprt_build/build.h>
#include <hiprt_build/instances.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/catch.h>
#include <tests/compat/program.h>
#include <tests/oracle/random.h>

#include <algorithm>
#include <vector>

namespace hiprt::test {

using oracle::Random;

constexpr std::uint64_t kSeed = 20261127;

/// Gives a built geometry a type: geomType + 1, and 0 for none.
inline void set_type(const SceneView& view, std::uint32_t geom_type) {
  auto& record = const_cast<GeometryRecord&>(view.geometries[0]);
  record.flags = (record.flags & 0xffu) | (geom_type + 1u) << 8;
}

/// Triangles, spheres, or both kinds in a scene, with what is needed to compute hits again.
using Points = std::vector<ShapePoint>;
using Corners = std::vector<build::Position>;

struct Triangles {
  std::vector<build::Position> positions;
  std::vector<build::Triangle> triangles;
  build::Bvh bvh;

  Triangles(Random& random, unsigned count, const build::BuildOptions& options = {}, float size = 0.3f) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const build::Position at = random.in_cube(1.0);
      for (unsigned corner = 0; corner < 3; ++corner) {
        const build::Position to = random.in_cube(size);
        positions.push_back({at[0] + to[0], at[1] + to[1], at[2] + to[2]});
      }
      triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    build(options);
  }
  explicit Triangles(std::vector<build::Position> corners, const build::BuildOptions& options = {})
      : positions(std::move(corners)) {
    for (std::uint32_t i = 0; i < positions.size(); i += 3) triangles.push_back({i, i + 1, i + 2});
    build(options);
  }
  SceneView view() const { return view_; }
  /// cross(v1 - v0, v2 - v0)
  std::array<double, 3> normal(std::uint32_t i) const {
    const auto edge = [&](std::size_t corner, std::size_t axis) {
      return double{positions[triangles[i][corner]][axis]} - double{positions[triangles[i][0]][axis]};
    };
    const auto component = [&](std::size_t a, std::size_t b) {
      return edge(1, a) * edge(2, b) - edge(1, b) * edge(2, a);
    };
    return {component(1, 2), component(2, 0), component(0, 1)};
  }

 private:
  SceneView view_;
  void build(const build::BuildOptions& options) {
    const build::TriangleMesh mesh{positions, triangles};
    auto built = build::build(std::span(&mesh, 1), options);
    REQUIRE(built.has_value());
    bvh = std::move(*built);
    view_ = bvh.scene();
  }
};

struct Spheres {
  std::vector<ShapePoint> spheres;
  std::vector<Box> boxes;
  build::Bvh bvh;

  Spheres(Random& random, unsigned count, double least = 0.05, double most = 0.3) {
    for (unsigned i = 0; i < count; ++i) {
      const build::Position at = random.in_cube(1.0);
      spheres.push_back({{at[0], at[1], at[2]}, random.uniform_float(least, most)});
    }
    build();
  }
  explicit Spheres(std::vector<ShapePoint> points) : spheres(std::move(points)) { build(); }
  SceneView view() const { return view_; }

 private:
  SceneView view_;
  void build() {
    for (const ShapePoint& point : spheres) boxes.push_back(sphere_bounds(point));
    const build::CustomGeometry custom{.boxes = boxes};
    auto built = build::build(build::SceneInput{{}, std::span(&custom, 1)}, {});
    REQUIRE(built.has_value());
    bvh = std::move(*built);
    view_ = bvh.scene();
  }
};

inline hiprtRay random_ray(Random& random) {
  const auto from = random.in_cube(2.0), to = random.in_cube(1.0);
  return make_ray({from[0], from[1], from[2]}, {to[0] - from[0], to[1] - from[1], to[2] - from[2]});
}

inline Ray own_ray(const hiprtRay& ray, std::uint32_t mask = ~0u, float time = 0.0f) {
  return {compat_detail::to_vec3(ray.origin), ray.minT, compat_detail::to_vec3(ray.direction), ray.maxT, mask, time};
}

/// All hits by AllHits, each once.
template <class P> auto own_hits(const SceneView& scene, const Ray& ray) {
  typename P::Stack::Memory memory;
  AllHits<P> query(scene, ray, memory);
  std::vector<typename AllHits<P>::Result> hits;
  for (auto hit = query.next_hit(); hit.found(); hit = query.next_hit()) hits.push_back(hit);
  return hits;
}

inline void check_normal(const hiprtHit& hit, const std::array<double, 3>& expected) {
  const double size = std::abs(expected[0]) + std::abs(expected[1]) + std::abs(expected[2]);
  CHECK(std::abs(hit.normal.x - expected[0]) <= 1e-5 * size);
  CHECK(std::abs(hit.normal.y - expected[1]) <= 1e-5 * size);
  CHECK(std::abs(hit.normal.z - expected[2]) <= 1e-5 * size);
}

inline bool is_miss(const hiprtHit& hit) {
  for (const std::uint32_t id : hit.instanceIDs)
    if (id != hiprtInvalidValue) return false;
  return !hit.hasHit() && hit.t == -1.0f && hit.uv == hiprtFloat2{0, 0} && hit.normal == hiprtFloat3{0, 0, 0};
}

/// A stack of a program's own, which counts what happens to it.
template <std::uint32_t kEntries> class OwnStack {
 public:
  std::uint32_t pushes = 0, resets = 0, deepest = 0;

  std::uint32_t pop() { return entries_[--size_]; }
  void push(std::uint32_t entry) {
    REQUIRE(size_ < kEntries);
    entries_[size_++] = entry;
    ++pushes;
    deepest = std::max(deepest, size_);
  }
  bool empty() const { return size_ == 0; }
  std::uint32_t vacancy() const { return kEntries - size_; }
  void reset() {
    size_ = 0;
    ++resets;
  }

 private:
  SceneView view_;
  std::uint32_t entries_[kEntries] = {};
  std::uint32_t size_ = 0;
};

}  // namespace hiprt::test
