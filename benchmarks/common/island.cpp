#include "island.h"

#include "mesh_parts.h"
#include "random.h"

#include <hiprt_device/math/vec_functions.h>
#include <algorithm>
#include <array>
#include <cmath>

namespace hiprt::bench {
namespace {

using build::Affine;

constexpr double kIslandRadius = 1600, kDistrictRadius = 120, kGroveRadius = 15;
constexpr std::uint32_t kTreeKinds = 6, kBushKinds = 2, kRockKinds = 2;
constexpr std::uint32_t kPlantKinds = kTreeKinds + kBushKinds + kRockKinds, kGroveKinds = 8, kDistrictKinds = 6;

/// Height of the ground: a flat dome with hills, which falls below the sea at the rim.
double height_at(double x, double z) {
  const double r = std::hypot(x, z) / kIslandRadius;
  double hills = 0, size = 90, frequency = 0.0021;
  for (int octave = 0; octave < 7; ++octave) {
    hills += size * std::sin(frequency * x + 2.3 * octave) * std::cos(frequency * (0.7 * x + z) - 1.1 * octave);
    size *= 0.42;
    frequency *= 2.2;
  }
  return 380.0 * (1.0 - r * r) * std::exp(-0.5 * r * r) + hills * (1.0 - 0.6 * r) - 20.0;
}

tools::Mesh ground(std::uint32_t cells) {
  tools::Mesh mesh;
  mesh.name = "ground";
  const double half = 1.2 * kIslandRadius;
  for (std::uint32_t row = 0; row <= cells; ++row)
    for (std::uint32_t column = 0; column <= cells; ++column) {
      const double x = half * (2.0 * column / cells - 1.0), z = half * (2.0 * row / cells - 1.0);
      add_vertex(mesh, {x, height_at(x, z), z});
    }
  add_grid_triangles(mesh, 0, cells, cells);
  return mesh;
}

/// Shape of a kind of trees.
struct Growth {
  double length, spread, leaf;
  std::uint32_t children, leaves;
};

class Plant {
 public:
  Plant(const Growth& growth, Random& random, double detail) : growth_(growth), random_(random), detail_(detail) {}

  tools::Mesh grow(const char* name, unsigned generations) {
    mesh_.name = name;
    branch({0, 0, 0}, {0, 1, 0}, growth_.length, 0.035 * growth_.length, generations);
    return std::move(mesh_);
  }

 private:
  Point shaken(const Point& direction, double by) {
    return glm::normalize(direction +
                          by * Point(random_.between(-1, 1), random_.between(-1, 1), random_.between(-1, 1)));
  }
  std::uint32_t scaled(std::uint32_t count) const {
    return std::max(1u, static_cast<std::uint32_t>(std::lround(count * detail_)));
  }

  void branch(const Point& from, const Point& direction, double length, double radius, unsigned generations) {
    constexpr std::uint32_t kRings = 5;
    std::array<Ring, kRings> rings;
    Point at = from, along = direction;
    for (std::uint32_t i = 0; i < kRings; ++i) {
      rings[i] = {at, radius * (1.0 - 0.6 * i / (kRings - 1))};
      along = shaken(along, 0.08);
      at += along * (length / (kRings - 1));
    }
    add_tube(mesh_, rings, generations > 1 ? 8 : 5);
    if (generations == 0) {
      for (std::uint32_t i = 0; i < scaled(growth_.leaves); ++i)
        leaf(from + (at - from) * random_.between(0.2, 1.0), shaken(along, 1.2));
      return;
    }
    for (std::uint32_t i = 0; i < growth_.children; ++i) {
      const double part = random_.between(0.45, 1.0);
      branch(from + (at - from) * part, shaken(along, growth_.spread), length * random_.between(0.45, 0.65),
             0.5 * radius, generations - 1);
    }
  }

  /// Two folded quads.
  void leaf(const Point& at, const Point& direction) {
    const Frame frame(direction);
    const double size = growth_.leaf * random_.between(0.6, 1.3);
    const Point side = frame.right * (0.3 * size), fold = frame.up * (0.08 * size);
    const auto first = static_cast<std::uint32_t>(mesh_.positions.size());
    for (const double along : {0.0, 0.5, 1.0}) {
      const double width = along == 0.5 ? 1.0 : 0.3;
      add_vertex(mesh_, at + direction * (size * along) - side * width + fold);
      add_vertex(mesh_, at + direction * (size * along) + side * width + fold);
    }
    add_grid_triangles(mesh_, first, 1, 2);
  }

  const Growth& growth_;
  Random& random_;
  double detail_;
  tools::Mesh mesh_;
};

/// A sphere with bumps.
tools::Mesh rock(Random& random, std::uint32_t rings) {
  tools::Mesh mesh;
  mesh.name = "rock";
  std::array<Point, 12> waves;
  for (Point& wave : waves) wave = 3.0 * Point(random.between(-1, 1), random.between(-1, 1), random.between(-1, 1));
  for (std::uint32_t ring = 0; ring <= rings; ++ring)
    for (std::uint32_t segment = 0; segment <= 2 * rings; ++segment) {
      const double polar = 0.5 * kTurn * (0.01 + 0.98 * ring / rings),
                   angle = kTurn * (segment % (2 * rings)) / (2 * rings);
      const Point unit(std::sin(polar) * std::cos(angle), std::cos(polar), std::sin(polar) * std::sin(angle));
      double radius = 1.0;
      for (const Point& wave : waves) radius += 0.06 * std::sin(glm::dot(wave, unit) + wave.x);
      add_vertex(mesh, unit * radius * Point(1.2, 0.7, 1.0));
    }
  add_grid_triangles(mesh, 0, 2 * rings, rings);
  return mesh;
}

std::vector<tools::Mesh> plants(double detail) {
  constexpr std::array<Growth, kTreeKinds> kTrees{{{9.0, 0.8, 0.5, 5, 100},
                                                   {12.0, 0.6, 0.4, 5, 105},
                                                   {7.0, 1.0, 0.5, 5, 90},
                                                   {14.0, 0.5, 0.45, 5, 95},
                                                   {10.0, 0.9, 0.35, 5, 120},
                                                   {8.0, 0.7, 0.6, 5, 85}}};
  constexpr std::array<Growth, kBushKinds> kBushes{{{1.6, 1.2, 0.2, 7, 90}, {1.1, 1.5, 0.15, 8, 100}}};
  Random random(7);
  std::vector<tools::Mesh> result;
  result.reserve(kPlantKinds + 1);
  for (const Growth& growth : kTrees) result.push_back(Plant(growth, random, detail).grow("tree", 3));
  for (const Growth& growth : kBushes) result.push_back(Plant(growth, random, detail).grow("bush", 2));
  const auto rings = std::max(3u, static_cast<std::uint32_t>(std::lround(80 * std::sqrt(detail))));
  for (std::uint32_t i = 0; i < kRockKinds; ++i) result.push_back(rock(random, rings));
  return result;
}

/// Rotates about y, scales, then translates. The object's y axis becomes @p up.
Affine transform(const Point& at, double turn, double scale, const Point& up = {0, 1, 0}) {
  const Point y = glm::normalize(up), forward(std::sin(turn), 0, std::cos(turn));
  const Point x = glm::normalize(glm::cross(y, forward)), z = glm::cross(x, y);
  Affine result;
  for (int r = 0; r < 3; ++r) {
    result.row[r][0] = static_cast<float>(scale * x[r]);
    result.row[r][1] = static_cast<float>(scale * y[r]);
    result.row[r][2] = static_cast<float>(scale * z[r]);
    result.row[r][3] = static_cast<float>(at[r]);
  }
  return result;
}

/// Point @p i of @p count, evenly over a disc (Vogel 1979).
Point on_disc(std::uint32_t i, std::uint32_t count, double radius) {
  constexpr double kGoldenAngle = 2.39996322972865332;
  const double r = radius * std::sqrt((i + 0.5) / count), angle = i * kGoldenAngle;
  return {r * std::cos(angle), 0, r * std::sin(angle)};
}

/// Trees at most, some bushes, few rocks.
std::uint32_t random_plant(Random& random) {
  const std::uint32_t which = random.below(100);
  if (which < 80) return random.below(kTreeKinds);
  if (which < 94) return kTreeKinds + random.below(kBushKinds);
  return kTreeKinds + kBushKinds + random.below(kRockKinds);
}

}  // namespace

tools::SceneDescription island(const IslandOptions& options) {
  tools::SceneDescription scene;
  scene.meshes = plants(options.detail);
  scene.meshes.push_back(
      ground(std::max(8u, static_cast<std::uint32_t>(std::lround(560 * std::sqrt(options.detail))))));
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) scene.objects.push_back({scene.meshes[i].name, {i}});
  const auto first_grove = static_cast<std::uint32_t>(scene.objects.size());
  Random random(11);
  for (std::uint32_t g = 0; g < kGroveKinds; ++g) {
    tools::SceneGroup& grove = scene.groups.emplace_back();
    grove.location = "grove " + std::to_string(g);
    for (std::uint32_t i = 0; i < options.plants; ++i)
      grove.instances.push_back({.object = random_plant(random),
                                 .to_scene = transform(on_disc(i, options.plants, kGroveRadius),
                                                       random.between(0, kTurn), random.between(0.6, 1.3))});
  }
  const std::uint32_t first_district = first_grove + kGroveKinds;
  for (std::uint32_t d = 0; d < kDistrictKinds; ++d) {
    tools::SceneGroup& district = scene.groups.emplace_back();
    district.location = "district " + std::to_string(d);
    for (std::uint32_t i = 0; i < options.groves; ++i)
      district.instances.push_back({.object = first_grove + random.below(kGroveKinds),
                                    .to_scene = transform(on_disc(i, options.groves, kDistrictRadius),
                                                          random.between(0, kTurn), random.between(0.85, 1.15))});
  }
  tools::SceneGroup& whole = scene.groups.emplace_back();
  whole.location = "island";
  whole.instances.push_back({.object = kPlantKinds});
  for (std::uint32_t i = 0; i < options.districts; ++i) {
    Point at = on_disc(i, options.districts, 0.93 * kIslandRadius);
    at.y = height_at(at.x, at.z);
    constexpr double kStep = 60;
    const Point up(height_at(at.x - kStep, at.z) - height_at(at.x + kStep, at.z), 2 * kStep,
                   height_at(at.x, at.z - kStep) - height_at(at.x, at.z + kStep));
    whole.instances.push_back({.object = first_district + random.below(kDistrictKinds),
                               .to_scene = transform(at, random.between(0, kTurn), random.between(0.9, 1.1), up)});
  }
  for (std::uint32_t i = 0; i < whole.instances.size(); ++i) whole.instances[i].id = i;
  return scene;
}

tools::Camera island_camera() {
  tools::Camera camera;
  camera.eye = {1250, 330, 1450};
  camera.at = {0, 150, 0};
  camera.fov_degrees = 42;
  return camera;
}

}  // namespace hiprt::bench
