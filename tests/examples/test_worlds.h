#pragma once
/// Scenes, rays and their hits by brute force: the inputs and the expected results of the kernels in test_examples.cpp.

#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/hip.h>
#include <hiprt_device/math/vec_functions.h>
#include <hiprt_device/primitives/round_curve.h>
#include <hiprt_device/primitives/sphere.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/every_hit.h>
#include <tests/traversal/explain.h>

#include <tests/catch.h>

#include <array>
#include <utility>
#include <vector>

#include "balls.h"

namespace hiprt::examples {

using namespace hiprt::checks;

inline constexpr std::uint64_t kSeed = 7417;
inline constexpr unsigned kCount = 1000;

/// Two soups, rays through them, and their closest hits by brute force.
struct World {
  std::vector<Mesh> meshes{soup(200, 0.8, kSeed), soup(100, 0.8, kSeed + 1)};
  std::vector<Ray> rays{kCount};
  std::vector<Hit> expected{kCount};

  World() {
    Random random(kSeed + 2);
    for (unsigned i = 0; i < kCount; ++i) {
      rays[i] = {vec3(random.in_cube(1.2)), 0.0f, vec3(random.in_cube(1))};
      if (const auto hits = every_hit(meshes, rays[i]); !hits.empty()) expected[i] = hits[0];
    }
  }
};

/// Calls kernel(arguments...) for kCount threads and a few more.
template <class Kernel, class... Arguments> void start(Kernel kernel, const Arguments&... arguments) {
  hipLaunchKernelGGL(kernel, dim3((kCount + 63) / 64), dim3(64), 0, nullptr, arguments...);
}

inline void check_hits(const std::vector<Hit>& hits, const std::vector<Hit>& expected) {
  INFO("seed " << kSeed);
  for (unsigned i = 0; i < kCount; ++i) {
    INFO("ray " << i << "\n" << describe(hits[i]) << "\n" << describe(expected[i]));
    REQUIRE(same_hit(hits[i], expected[i]));
  }
}

/// Adds the ray's hits of primitives [0, count) of the type.
template <class Primitives>
void add_custom_hits(const Ray& ray, const Primitives& primitives, unsigned type, std::uint32_t geometry,
                     std::size_t count, std::vector<Hit>& hits) {
  for (std::uint32_t i = 0; i < count; ++i)
    primitives.intersect(type, ray, ray.tmin, ray.tmax, PrimitiveId{geometry, i}, [&](const CustomHit& at) {
      if (in_range(ray, at.t)) hits.push_back({at.t, at.u, at.v, geometry, i, at.normal, at.error});
      return true;
    });
}

inline Hit first_of(std::vector<Hit> hits) {
  sort_hits(hits);
  return hits.empty() ? Hit{} : hits[0];
}

/// Rounds, the boxes of balls or discs of them, and a scene of both and triangles.
struct RoundWorld {
  std::vector<Round> rounds[2];
  std::vector<Box> boxes[2];
  build::Bvh bvh;
  SceneView scene;

  RoundWorld(const std::vector<Mesh>& meshes, bool second_are_discs) {
    Random random(kSeed + 4);
    for (const unsigned type : {0u, 1u})
      for (unsigned i = 0; i < 100; ++i) {
        const Round round{vec3(random.in_cube(1)), random.uniform_float(0.05, 0.2)};
        rounds[type].push_back(round);
        Box& box = boxes[type].emplace_back();
        for (int k = 0; k < 3; ++k) {
          const float half = (k == 2 && type == 1 && second_are_discs ? 0.0f : round.radius) + 1e-5f;
          box.min[k] = round.centre[k] - half;
          box.max[k] = round.centre[k] + half;
        }
      }
    const auto views = oracle::views(meshes);
    const std::array<build::CustomGeometry, 2> customs{{{boxes[0], 0}, {boxes[1], 1}}};
    auto built = build::build(build::SceneInput{views, customs});
    REQUIRE(built.has_value());
    bvh = std::move(*built);
    const auto view = open_buffer(std::as_const(bvh.buffer).bytes());
    REQUIRE(view.has_value());
    scene = make_scene_view(*view);
  }

  /// The closest hit of the triangles and of every primitive of the set.
  template <class Primitives>
  Hit closest(const std::vector<Mesh>& meshes, const Ray& ray, const Primitives& primitives) const {
    std::vector<Hit> hits = every_hit(meshes, ray);
    const auto first = static_cast<std::uint32_t>(meshes.size());
    for (const unsigned type : {0u, 1u})
      add_custom_hits(ray, primitives, type, first + type, rounds[type].size(), hits);
    return first_of(std::move(hits));
  }
};

/// Balls and strands of hair.
struct HairWorld {
  std::vector<Sphere> spheres;
  std::vector<CurveVertex> vertices;
  std::vector<std::uint32_t> first_vertex;

  HairWorld() {
    constexpr unsigned kStrands = 30, kSegments = 5;
    Random random(kSeed + 5);
    const auto step = [&] { return random.uniform_float(-0.3, 0.3); };
    for (unsigned i = 0; i < 60; ++i) {
      const Vec3 center = vec3(random.in_cube(1));
      spheres.push_back({{center.x, center.y, center.z}, random.uniform_float(0.05, 0.2)});
    }
    for (unsigned strand = 0; strand < kStrands; ++strand) {
      Vec3 at = vec3(random.in_cube(1));
      for (unsigned i = 0; i <= kSegments; ++i, at += Vec3(step(), step(), step())) {
        if (i < kSegments) first_vertex.push_back(static_cast<std::uint32_t>(vertices.size()));
        vertices.push_back({{at.x, at.y, at.z}, random.uniform_float(0.0, 0.1)});
      }
    }
  }
};

}  // namespace hiprt::examples
