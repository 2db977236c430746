#pragma once
/// Scenes and difficult rays of the tests that compare a GPU with the host.

#include <hiprt_build/build.h>
#include <hiprt_device/primitives/round_curve.h>
#include <hiprt_device/primitives/sphere.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <string>

namespace hiprt::checks {

/// Vertices of a strand of hair; its segments meet in balls that both report.
inline constexpr std::uint32_t kStrand = 5;

struct SceneSource {
  std::string name;
  std::vector<oracle::Mesh> meshes;
  build::Builder builder = build::Builder::kSah;
  std::vector<Sphere> spheres{};    ///< One geometry behind the meshes, of custom type 0.
  std::vector<CurveVertex> hair{};  ///< The next, of type 1: strands of kStrand vertices.
  bool has_customs() const { return !spheres.empty(); }
};

/// Two geometries with different masks: a closed, jagged star, and triangles of all sizes around it.
inline std::vector<oracle::Mesh> star_in_soup(std::uint64_t seed) {
  oracle::Random random(seed);
  oracle::Mesh soup;
  for (int i = 0; i < 2000; ++i) {
    const oracle::Position center = random.in_cube(2.0);
    const double size = random.log_uniform(1e-4, 1.0);
    std::array<oracle::Position, 3> corner{};
    for (oracle::Position& p : corner) {
      p = random.in_cube(size);
      for (std::size_t k = 0; k < 3; ++k) p[k] += center[k];
    }
    oracle::append(soup, corner[0], corner[1], corner[2]);
  }
  std::vector<oracle::Mesh> meshes{oracle::star(4, seed), std::move(soup)};
  meshes[0].mask = 1;
  meshes[1].mask = 2;
  return meshes;
}

inline std::vector<Sphere> random_spheres(unsigned count, std::uint64_t seed) {
  oracle::Random random(seed);
  std::vector<Sphere> spheres(count);
  for (Sphere& sphere : spheres) {
    const oracle::Position center = random.in_cube(2.0);
    sphere = {{center[0], center[1], center[2]}, static_cast<float>(random.log_uniform(1e-3, 0.3))};
  }
  return spheres;
}

inline std::vector<CurveVertex> random_hair(unsigned strands, std::uint64_t seed) {
  oracle::Random random(seed);
  std::vector<CurveVertex> hair;
  for (unsigned strand = 0; strand < strands; ++strand) {
    oracle::Position at = random.in_cube(2.0);
    for (unsigned i = 0; i < kStrand; ++i) {
      const oracle::Position step = random.in_cube(0.3);
      for (std::size_t k = 0; k < 3; ++k) at[k] += step[k];
      hair.push_back({{at[0], at[1], at[2]}, static_cast<float>(random.log_uniform(1e-3, 0.1))});
    }
  }
  return hair;
}

/// The first vertex of each segment.
inline std::vector<std::uint32_t> segments_of(const std::vector<CurveVertex>& hair) {
  std::vector<std::uint32_t> first;
  for (std::uint32_t i = 0; i < hair.size(); ++i)
    if (i % kStrand + 1 != kStrand) first.push_back(i);
  return first;
}

inline std::vector<SceneSource> scene_sources(std::uint64_t seed) {
  return {{"soup", star_in_soup(seed)},
          {"sphere", {oracle::icosphere(4)}},
          {"split", {oracle::needles(1000, 50.0, seed + 1)}, oracle::kEmbreeHigh},
          {"custom",
           {oracle::star(3, seed + 2)},
           build::Builder::kSah,
           random_spheres(700, seed + 3),
           random_hair(200, seed + 4)}};
}

constexpr const char* layout_name(NodeLayout layout) {
  switch (layout) {
    case NodeLayout::kFloat:
      return "float";
    case NodeLayout::kPlanes:
      return "planes";
    case NodeLayout::kHalf:
      return "half";
    case NodeLayout::kQuantized:
      return "quantized";
  }
  return "";
}
inline std::string file_name(const std::string& scene, NodeLayout layout) {
  return scene + "." + layout_name(layout) + ".bvh";
}

struct Target {
  oracle::Double3 point;
  bool at_edge;
};

/// A vertex, the middle of an edge, or a point inside a triangle; of a sphere: anything near its surface; a joint of
/// hair.
inline Target random_target(const SceneSource& scene, oracle::Random& random) {
  if (scene.has_customs() && random.coin()) {
    if (random.coin()) {
      const auto& joint = scene.hair[random.below(static_cast<std::uint32_t>(scene.hair.size()))].position;
      return {{joint[0], joint[1], joint[2]}, false};
    }
    const Sphere& sphere = scene.spheres[random.below(static_cast<std::uint32_t>(scene.spheres.size()))];
    oracle::Double3 point = random.on_sphere();
    for (std::size_t k = 0; k < 3; ++k) point[k] = sphere.center[k] + 0.99 * double{sphere.radius} * point[k];
    return {point, false};
  }
  const oracle::Mesh& mesh = scene.meshes[random.below(static_cast<std::uint32_t>(scene.meshes.size()))];
  const oracle::Triangle& triangle = mesh.triangles[random.below(static_cast<std::uint32_t>(mesh.triangles.size()))];
  const oracle::Position &a = mesh.positions[triangle[0]], &b = mesh.positions[triangle[1]],
                         &c = mesh.positions[triangle[2]];
  const unsigned kind = random.below(4);
  const double s = kind == 0 ? 0.0 : kind == 1 ? 0.5 : random.unit(), r = kind < 2 ? 0.0 : (1 - s) * random.unit();
  oracle::Double3 point{};
  for (std::size_t k = 0; k < 3; ++k) point[k] = a[k] + s * (double{b[k]} - a[k]) + r * (double{c[k]} - a[k]);
  return {point, kind < 2};
}

struct AimedRay {
  Ray ray;
  bool at_edge;  ///< Aimed at a vertex or edge, where rounding decides the hit.
};

/// From anywhere at a target; along an axis; or anyhow. Lengths, ranges and masks vary.
inline AimedRay random_ray(const SceneSource& scene, oracle::Random& random) {
  const Target target = random_target(scene, random);
  const double length = random.log_uniform(0.01, 100.0);
  const oracle::Position from = random.in_cube(3.0);
  const unsigned kind = random.below(6);
  Ray ray;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    ray.origin[k] = from[i];
    ray.direction[k] = static_cast<float>((target.point[i] - from[i]) * length);
    if (kind == 0) ray.direction[k] = 0.0f;
    if (kind == 1) ray.direction[k] = random.uniform_float(-1.0, 1.0);
  }
  if (kind == 0) ray.direction[static_cast<int>(random.below(3))] = random.coin() ? 1.0f : -0.0f;
  if (random.below(8) == 0) ray.tmin = random.uniform_float(-0.5, 0.5);
  if (random.below(4) == 0) ray.tmax = random.uniform_float(0.0, 2.0);
  ray.mask = random.below(4) == 0 ? 1 + random.below(2) : 3;
  return {ray, target.at_edge && kind > 1};
}

}  // namespace hiprt::checks
