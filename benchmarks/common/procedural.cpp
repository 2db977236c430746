#include "procedural.h"

#include "mesh_parts.h"
#include "random.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace hiprt::bench {
namespace {

double ground_height(double x, double z) {
  double height = 0, size = 4, frequency = 0.06;
  for (int octave = 0; octave < 6; ++octave) {
    const double shift = 1.7 * octave;
    height += size * std::sin(frequency * x + shift) * std::cos(frequency * (0.8 * z - 0.6 * x) - shift);
    size *= 0.5;
    frequency *= 2.1;
  }
  return height;
}

build::Position position(double x, double y, double z) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
}

constexpr std::uint32_t kSegments = 16, kRings = 9;
constexpr std::uint32_t kSphereTriangles = 2 * kSegments * kRings;

/// A sphere with three radii, turned around the y axis. Its poles are slightly open, so that no triangle is degenerate.
void add_sphere(tools::Mesh& mesh, Random& random) {
  const double x = random.between(-kGroundHalf, kGroundHalf), z = random.between(-kGroundHalf, kGroundHalf);
  const double y = ground_height(x, z) + random.between(0.0, 6.0);
  const double size = 0.2 * std::exp(random.between(0.0, 2.5)), turn = random.between(0.0, kTurn);
  const double width = size * random.between(0.2, 1.0), height = size * random.between(0.2, 2.0);
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (std::uint32_t ring = 0; ring <= kRings; ++ring)
    for (std::uint32_t segment = 0; segment <= kSegments; ++segment) {
      const double angle = kTurn * (segment % kSegments) / kSegments;
      const double polar = std::numbers::pi * (0.02 + 0.96 * ring / kRings);
      const double u = size * std::sin(polar) * std::cos(angle), v = width * std::sin(polar) * std::sin(angle);
      mesh.positions.push_back(position(x + u * std::cos(turn) - v * std::sin(turn), y + height * std::cos(polar),
                                        z + u * std::sin(turn) + v * std::cos(turn)));
    }
  add_grid_triangles(mesh, first, kSegments, kRings);
}

}  // namespace

tools::Mesh height_field(std::uint32_t triangles) {
  const auto cells = std::max(1u, static_cast<std::uint32_t>(std::lround(std::sqrt(0.5 * triangles))));
  tools::Mesh mesh;
  mesh.name = "height_field";
  for (std::uint32_t row = 0; row <= cells; ++row)
    for (std::uint32_t column = 0; column <= cells; ++column) {
      const double x = kGroundHalf * (2.0 * column / cells - 1.0), z = kGroundHalf * (2.0 * row / cells - 1.0);
      mesh.positions.push_back(position(x, ground_height(x, z), z));
    }
  add_grid_triangles(mesh, 0, cells, cells);
  return mesh;
}

tools::Mesh procedural_mesh(std::uint32_t triangles) {
  tools::Mesh mesh = height_field(std::max(2u, triangles / 2));
  mesh.name = "procedural";
  Random random;
  for (std::uint32_t i = 0; i < triangles / 2 / kSphereTriangles; ++i) add_sphere(mesh, random);
  return mesh;
}

tools::Mesh scattered(const tools::Mesh& mesh) {
  tools::Mesh result;
  result.name = mesh.name + " scattered";
  std::vector<build::Triangle> order = mesh.triangles;
  std::mt19937 random;
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  for (const build::Triangle& triangle : order) {
    const auto first = static_cast<std::uint32_t>(result.positions.size());
    for (const std::uint32_t index : triangle) result.positions.push_back(mesh.positions[index]);
    result.triangles.push_back({first, first + 1, first + 2});
  }
  return result;
}

tools::Camera procedural_camera() {
  tools::Camera camera;
  camera.eye = {0.9 * kGroundHalf, 14.0, 0.75 * kGroundHalf};
  camera.at = {0.0, 0.0, 0.0};
  camera.fov_degrees = 55.0;
  return camera;
}

}  // namespace hiprt::bench
