#pragma once
/// Inputs: meshes, points, rays and motions on a lattice. Sums of lattice numbers and products with powers of two are
/// exact, with contraction too, so no compiler setting changes them. The library computes the points that instances
/// transform, with the same bits everywhere.

#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/oracle/meshes.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

namespace hiprt::flags {

using oracle::Mesh;
using oracle::Random;

inline constexpr std::uint64_t kSeed = 20261123;
inline constexpr float kLattice = 0x1p-12f;

template <class Value> Value must(build::Result<Value> result) {
  if (result) return std::move(*result);
  std::fprintf(stderr, "%s\n", result.error().message.c_str());
  std::exit(2);
}

inline SceneView view_of(const build::Bvh& bvh) { return make_scene_view(*open_buffer(bvh.buffer.bytes())); }
inline Vec3 vec3(const build::Position& p) { return Vec3(p[0], p[1], p[2]); }

/// An integer in [-most, most].
inline int integer(Random& random, std::uint32_t most) {
  return static_cast<int>(random.below(2 * most + 1)) - static_cast<int>(most);
}
/// A number of the lattice, up to @p steps of it from 0.
inline float coordinate(Random& random, std::uint32_t steps) {
  return static_cast<float>(integer(random, steps)) * kLattice;
}
/// A point on the lattice in the cube of half edge @p steps.
inline Vec3 lattice_point(Random& random, std::uint32_t steps) {
  const float x = coordinate(random, steps), y = coordinate(random, steps), z = coordinate(random, steps);
  return Vec3(x, y, z);
}
/// 2^k for a random k in [-range, range].
inline float power(Random& random, std::uint32_t range) { return std::ldexp(1.0f, integer(random, range)); }

/// A closed mesh around the origin whose vertices are on the lattice, neighbours at different distances: each in
/// [1/4, 3/4). @param levels of icosphere().
inline Mesh lattice_mesh(unsigned levels) {
  Mesh mesh = oracle::icosphere(levels);
  Random random(kSeed);
  for (build::Position& p : mesh.positions) {
    const auto size = static_cast<double>(1024 + random.below(2048));
    for (float& x : p) x = static_cast<float>(std::round(double{x} * size)) * kLattice;
  }
  return mesh;
}

inline const build::Triangle& any_triangle(const Mesh& mesh, Random& random) {
  return mesh.triangles[random.below(static_cast<std::uint32_t>(mesh.triangles.size()))];
}

/// A vertex of the mesh, the middle of an edge, or anywhere.
inline Vec3 target(const Mesh& mesh, Random& random) {
  const build::Triangle t = any_triangle(mesh, random);
  const Vec3 a = vec3(mesh.positions[t[0]]), b = vec3(mesh.positions[t[1]]);
  const std::uint32_t kind = random.below(3);
  const Vec3 anywhere = lattice_point(random, 8192);
  return kind == 0 ? a : kind == 1 ? 0.5f * (a + b) : anywhere;
}

/// One copy of a traversal per program: without it compilers make one per call, and take minutes.
template <class P> [[gnu::noinline]] auto closest(const SceneView& scene, const BasicRay<typename P::Real>& ray) {
  return closest_hit<P>(scene, ray);
}

inline Ray between(const Vec3& from, const Vec3& to) {
  Ray ray;
  ray.origin = from;
  ray.direction = to - from;
  return ray;
}

/// A time from before the first key of lattice_motion() to behind its last.
inline float any_time(Random& random) { return static_cast<float>(integer(random, 1024) + 256) * 0x1p-8f; }

/// A transform with any rotation, scale and shear, sometimes mirrored, up to @p spread from the origin.
/// @param flat 1, or a power of two below: how much shorter than others the image of some direction is, none of the
/// axes.
inline build::Affine lattice_affine(Random& random, std::uint32_t spread, float flat = 1.0f) {
  build::Affine affine;
  do {
    for (auto& row : affine.row)
      for (unsigned c = 0; c < 3; ++c) row[c] = 0.25f * static_cast<float>(integer(random, 6));
    if (flat != 1.0f)
      for (unsigned c = 0; c < 3; ++c)
        affine.row[2][c] = affine.row[0][c] - 0.5f * affine.row[1][c] + flat * affine.row[2][c];
  } while (!build::is_invertible(affine));
  for (auto& row : affine.row) row[3] = static_cast<float>(integer(random, spread));
  return affine;
}

/// Rotations up to 180 degrees, with uneven scales, shears and times; a third are mirrored. Rotations of
/// MotionKind::kMatrix are small, so that all interpolated matrices are invertible.
inline build::Motion lattice_motion(Random& random, MotionKind kind, unsigned keys, std::uint32_t spread) {
  build::Motion motion;
  motion.kind = kind;
  const float mirrored = random.below(3) == 0 ? -1.0f : 1.0f;
  float time = -1.0f;
  for (unsigned k = 0; k < keys; ++k) {
    build::MotionKey key;
    key.time = time;
    time += 0.25f * static_cast<float>(1 + random.below(8));
    for (float& x : key.translation) x = static_cast<float>(integer(random, spread));
    for (unsigned i = 0; i < 3; ++i) {
      key.rotation[i] = static_cast<float>(integer(random, kind == MotionKind::kMatrix ? 1 : 4));
      key.scale[i] = 0.25f * static_cast<float>(3 + random.below(3));
      key.shear[i] = 0.25f * static_cast<float>(integer(random, 1));
    }
    // Odd: never a quaternion of length 0.
    key.rotation[3] = static_cast<float>(kind == MotionKind::kMatrix ? 9 : 2 * integer(random, 1) + 1);
    key.scale[1] *= mirrored;
    motion.keys.push_back(key);
  }
  return motion;
}

/// Whether some turn is by exactly 180 degrees: both directions are equally short.
inline bool has_half_turn(const build::Motion& motion) {
  for (std::size_t k = 1; k < motion.keys.size(); ++k) {
    float dot = 0;
    for (unsigned i = 0; i < 4; ++i) dot += motion.keys[k - 1].rotation[i] * motion.keys[k].rotation[i];
    if (dot == 0.0f) return true;
  }
  return false;
}

/// A point of the object at the end of an instance path, in scene space.
template <unsigned kLevels>
[[gnu::noinline]] Vec3D to_scene_in_double(const SceneView& scene, const InstancePath<kLevels>& path, float time,
                                           const Vec3& point) {
  std::vector<InstanceRecord> records;
  follow(scene, path, time,
         [&](const InstanceRecord& record, const ObjectRecord&, const MotionRecord*) { records.push_back(record); });
  Vec3D p(point);
  for (; !records.empty(); records.pop_back()) p = point_to_scene(records.back(), p);
  return p;
}
/// The same rounded to floats.
template <unsigned kLevels>
Vec3 to_scene(const SceneView& scene, const InstancePath<kLevels>& path, float time, const Vec3& point) {
  const Vec3D p = to_scene_in_double(scene, path, time, point);
  return Vec3(nearest_float(p.x), nearest_float(p.y), nearest_float(p.z));
}

/// The instance path to the scene's one object, through first instances.
template <unsigned kLevels> InstancePath<kLevels> only_path(const SceneView& scene) {
  InstancePath<kLevels> path;
  if constexpr (kLevels != 0) path.depth = scene.levels;
  return path;
}

}  // namespace hiprt::flags
