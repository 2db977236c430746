#pragma once
/// Closed meshes below extreme instances, still and moving, and rays that look for leaks and NaNs.

#include <tests/traversal/aim.h>
#include <tests/traversal/instances/moving_scenes.h>

#include <bit>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace hiprt::checks {

/// What lies between a mesh and the scene.
struct ExtremeChain {
  std::string name;
  std::vector<Affine> inwards;               ///< An instance each, the outermost first.
  std::optional<build::Motion> motion = {};  ///< Of the outermost.
};

/// A mesh below one instance after the other.
struct Chain : InstanceScene {
  build::Motion motion{};

  /// Built, and checked.
  Chain(const Mesh& mesh, const ExtremeChain& chain) {
    add_file({mesh}, NodeLayout::kPlanes);
    for (std::size_t i = chain.inwards.size(); i-- > 0;)
      groups.push_back({Instance{.object = static_cast<std::uint32_t>(groups.size()), .to_scene = chain.inwards[i]}});
    if (chain.motion) {
      motion = *chain.motion;
      groups.back()[0].motion = &motion;
    }
    build();
  }
  Chain(const Chain&) = delete;
  Chain& operator=(const Chain&) = delete;

  unsigned levels() const { return static_cast<unsigned>(groups.size()); }

  /// A point of the mesh, where the scene has it at a time.
  Vec3D out_of(float time, const Double3& point) const {
    InstancePath<kMostLevels> path;
    path.depth = levels();
    std::vector<InstanceRecord> records;
    follow(view(), path, time,
           [&](const InstanceRecord& record, const ObjectRecord&, const MotionRecord*) { records.push_back(record); });
    Vec3D p(point[0], point[1], point[2]);
    while (!records.empty()) {
      p = point_to_scene(records.back(), p);
      records.pop_back();
    }
    return p;
  }

  /// From inside of the mesh, at a time about [0, 1], to one of its vertices, edges or insides.
  Ray ray_from_inside(const Closed& closed, Random& random) const {
    const Double3 target = target_point(closed.mesh, random), aside = random.on_sphere();
    const Double3& center = closed.centers[random.below(static_cast<std::uint32_t>(closed.centers.size()))];
    Double3 start;
    for (std::size_t k = 0; k < 3; ++k) start[k] = center[k] + 0.5 * closed.inner_radius * aside[k];
    Ray ray;
    ray.time = random.uniform_float(-1, 2);
    ray.origin = Vec3(out_of(ray.time, start));
    ray.direction = Vec3(out_of(ray.time, target) - Vec3D(ray.origin));
    return ray;
  }
};

/// Scales to 1e-13 and 1e13, flat, long, sheared, mirrored, far away; 3 and 16 levels of anything.
inline std::vector<ExtremeChain> still_extremes(Random& random) {
  const Affine sheared{{{1, 1000, 0, 2}, {0, 1, 0, -1}, {0, 0, 1, 3}}};
  std::vector<ExtremeChain> result{{"scale 1e-13", {affine({0, 0.6, 0.8}, 1, {1e-13, 1e-13, 1e-13}, {0, 0, 0})}},
                                   {"scale 1e13", {affine({0, 0.6, 0.8}, 1, {1e13, 1e13, 1e13}, {0, 0, 0})}},
                                   {"flat to 1e-6", {affine({0.6, 0, 0.8}, 2, {1, 1, 1e-6}, {0, 0, 0})}},
                                   {"a rod of 1e4", {affine({0.6, 0, 0.8}, 2, {1, 1, 1e4}, {3, 2, 1})}},
                                   {"sheared by 1000", {sheared}},
                                   {"mirrored", {affine({1, 0, 0}, 0.3, {-1, 1, 1}, {0, 5, 0})}},
                                   {"1e5 away", {affine({1, 0, 0}, 0.3, {2, 1, 1}, {1e5, -3e4, 7e4})}}};
  for (const unsigned levels : {3u, kMostLevels}) {
    ExtremeChain chain{std::to_string(levels) + " levels", {}};
    for (unsigned i = 0; i < levels; ++i) chain.inwards.push_back(random_affine(random, 4));
    result.push_back(chain);
  }
  return result;
}

/// Turns by 1e-5 to 180 degrees and any motions, by parts and by matrices, above two instances.
inline std::vector<ExtremeChain> moving_extremes(Random& random) {
  const std::vector<Affine> inwards{Affine{}, affine({0, 0, 1}, 0.7, {1, 2, 0.5}, {0.5, 0, 0})};
  std::vector<ExtremeChain> result;
  for (const double degrees : {1e-5, 1.0, 90.0, 179.9, 180.0})
    for (const MotionKind kind : {MotionKind::kSlerp, MotionKind::kNlerp})
      result.push_back(
          {std::to_string(degrees) + (kind == MotionKind::kSlerp ? " degrees, slerp" : " degrees, nlerp"), inwards,
           build::Motion{.keys = {turned_key(0, {0.6, 0, 0.8}, 0),
                                  turned_key(1, {0.6, 0, 0.8}, degrees * std::numbers::pi / 180, {2, -1, 3})},
                         .kind = kind}});
  result.push_back({"any parts", inwards, random_motion(random, MotionKind::kSlerp, 4, 3)});
  build::Motion matrices = random_motion(random, MotionKind::kMatrix, 4, 3);
  for (const build::MotionKey& key : matrices.keys) matrices.matrices.push_back(build::compose(key));
  matrices.keys.clear();
  result.push_back({"any matrices", inwards, matrices});
  return result;
}

/// The closed meshes that are small enough to be built again and again.
inline std::vector<Closed> small_closed_meshes() {
  std::vector<Closed> result = closed_meshes();
  std::erase_if(result, [](const Closed& closed) { return closed.mesh.triangles.size() > 4000; });
  return result;
}

/// Any 32 bits, or a plausible value of a ray.
inline float any_bits(Random& random, double scale) {
  if (random.below(3) == 0) return std::bit_cast<float>(random.below(0xffffffffu));
  return random.uniform_float(-scale, scale);
}

/// Half of them about the middle, half of any bits; times and ends of any bits.
inline Ray ray_of_any_bits(Random& random) {
  Ray ray;
  const bool wild = random.coin();
  for (int k = 0; k < 3; ++k) {
    ray.origin[k] = wild ? any_bits(random, 6) : random.uniform_float(-6, 6);
    ray.direction[k] = wild ? any_bits(random, 6) : -ray.origin[k] + random.uniform_float(-1, 1);
  }
  ray.tmin = random.below(4) == 0 ? any_bits(random, 1) : 0.0f;
  ray.tmax = random.below(4) == 0 ? any_bits(random, 2) : std::numeric_limits<float>::infinity();
  ray.time = any_bits(random, 3);
  return ray;
}

}  // namespace hiprt::checks
