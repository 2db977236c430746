// Closed meshes of needles, 10^7 times as long as wide: no ray from inside leaks.

#include <hiprt_device/math/vec_functions.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/double_rays.h>
#include <tests/traversal/tracers.h>
#include <tests/traversal/workers.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261125;
constexpr double kAspect = 1e7;

/// Two pyramids over one ring around the origin, pointed at +-axis: every triangle is as long as the axis and about
/// 1 / kAspect of that wide. However the axis lies, floats can hold the ring, which is near 0.
Mesh double_pyramid(unsigned sides, const Vec3D& axis) {
  const Vec3D side = glm::normalize(glm::cross(axis, Vec3D(axis.y, axis.z, -axis.x))),
              across = glm::normalize(glm::cross(axis, side));
  const auto position = [](const Vec3D& p) { return rounded({p.x, p.y, p.z}); };
  Mesh mesh;
  mesh.positions = {position(axis), position(-axis)};
  for (unsigned i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    mesh.positions.push_back(
        position(glm::length(axis) / kAspect * (std::cos(angle) * side + std::sin(angle) * across)));
  }
  for (unsigned i = 0; i < sides; ++i) {
    const std::uint32_t a = 2 + i, b = 2 + (i + 1) % sides;
    mesh.triangles.insert(mesh.triangles.end(), {{0, a, b}, {1, b, a}});
  }
  return mesh;
}

/// A ball with one corner in four at radius 1 and the others at 1 / kAspect: needles surround every spike.
/// Star-shaped around the origin.
Mesh hedgehog(unsigned levels, std::uint64_t seed) {
  Random random(seed);
  Mesh mesh = icosphere(levels);
  for (Position& p : mesh.positions) {
    const double distance = random.below(4) == 0 ? 1.0 : random.uniform(0.5, 2) / kAspect;
    p = rounded({p[0] * distance, p[1] * distance, p[2] * distance});
  }
  return mesh;
}

/// Of the triangles' longest edges over their heights the largest and the median.
std::pair<double, double> aspects(const Mesh& mesh) {
  std::vector<double> all;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Corners c = corners(mesh, i);
    const Vec3D a = vec(c.p1) - vec(c.p0), b = vec(c.p2) - vec(c.p0);
    const double longest = std::max({glm::length(a), glm::length(b), glm::length(a - b)});
    all.push_back(longest * longest / glm::length(glm::cross(a, b)));
  }
  std::sort(all.begin(), all.end());
  return {all.back(), all[all.size() / 2]};
}

/// How far the planes of the triangles are from the origin, at least.
double inner_radius_of(const Mesh& mesh) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Corners c = corners(mesh, i);
    const Vec3D p = vec(c.p0), normal = glm::cross(vec(c.p1) - p, vec(c.p2) - p);
    least = std::min(least, std::abs(glm::dot(p, normal)) / glm::length(normal));
  }
  return least;
}

std::vector<Closed> thin_meshes() {
  std::vector<Closed> result{{"pyramids along z", double_pyramid(8, {0, 0, 1}), {{0, 0, 0}}},
                             {"pyramids along a diagonal", double_pyramid(7, {1, 1, -1}), {{0, 0, 0}}},
                             {"pyramids along any axis", double_pyramid(12, {0.3, 0.7, -0.4}), {{0, 0, 0}}},
                             {"spindle", spindle(8, 40, 20 * kAspect), {{0, 0, 0}}},
                             {"hedgehog", hedgehog(3, kSeed), {{0, 0, 0}}}};
  for (Closed& closed : result) closed.inner_radius = 0.5 * inner_radius_of(closed.mesh);
  return result;
}

}  // namespace

TEST_CASE("no ray from inside a closed mesh of needles leaks: the default, Reference, double", "[watertight]") {
  INFO("seed " << kSeed);
  for (const Closed& unit : thin_meshes()) {
    const auto [most, median] = aspects(unit.mesh);
    std::printf("thin meshes: %s, needles to %.2g : 1, half of them above %.2g : 1, inner radius %.2g\n",
                unit.name.c_str(), most, median, unit.inner_radius);
    REQUIRE(is_closed(unit.mesh));
    CHECK(most > 1e7);
    CHECK(unit.inner_radius > 0);
    for (const double scale : {1.0, 1e-10, 3e9}) {
      const Closed closed = checks::placed(unit, scale, {0, 0, 0});
      for (const NodeLayout layout : {NodeLayout::kPlanes, NodeLayout::kQuantized}) {
        const Scene scene = make_scene({closed.mesh}, {.nodes = layout});
        Random random(kSeed);
        std::map<std::string, unsigned> leaks;
        std::string first;
        const unsigned rays = trials(3000);
        for (unsigned i = 0; i < rays; ++i) {
          const Ray ray = aimed_ray(closed, random, 1e6);
          const RayD far = convert<double>(ray);
          const auto count = [&](const char* name, bool found) {
            leaks[name] += found ? 0 : 1;
            if (!found && first.empty()) first = name + (": " + describe(far));
          };
          if (i < 20) count("exact", oracle::closest(std::span(&closed.mesh, 1), ray).found);
          for (const Tracer& tracer : all_tracers())
            if (tracer.guaranteed)
              count(tracer.name, tracer.closest(scene, ray).found() && tracer.any(scene, ray).found());
          count("double", checks::closest(scene.traced, far).found() && checks::any(scene.traced, far));
        }
        for (const auto& [name, number] : leaks) {
          INFO(unit.name << " at scale " << scale << ", " << scene.name << ", first " << first);
          CAPTURE(name);
          CHECK(number == 0);
        }
      }
    }
  }
}
