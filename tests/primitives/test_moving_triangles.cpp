// Meshes that deform: at every time they are hit as the mesh of that time is.

#include <tests/oracle/meshes.h>
#include <tests/oracle/motions.h>
#include <tests/traversal/every_hit.h>

#include <hiprt_device/primitives/moving_triangle.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Mesh;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261124;

/// A mesh in several places, as a program holds it.
struct Deforming {
  std::vector<Mesh> keys;
  std::vector<float> times, positions;
  std::vector<std::uint32_t> triangles;
  std::vector<Box> boxes;
  build::Buffer file;

  Deforming(std::vector<Mesh> of_keys, std::vector<float> of_times)
      : keys(std::move(of_keys)), times(std::move(of_times)) {
    for (const Mesh& key : keys)
      for (const auto& p : key.positions) positions.insert(positions.end(), p.begin(), p.end());
    for (const auto& t : keys[0].triangles) triangles.insert(triangles.end(), t.begin(), t.end());
    for (std::uint32_t i = 0; i < keys[0].triangles.size(); ++i) boxes.push_back(set().bounds(i));
    const build::CustomGeometry geometry[1] = {{.boxes = boxes}};
    auto bvh = build::build(build::SceneInput{{}, geometry}, {.builder = build::Builder::kHploc});
    REQUIRE(bvh.has_value());
    file = std::move(bvh->buffer);
  }
  MovingTriangleSet set() const {
    return {{positions.data(), times.data(), triangles.data(), static_cast<std::uint32_t>(keys[0].positions.size()),
             static_cast<std::uint32_t>(keys.size())}};
  }
  /// As it is at a time, in floats.
  Mesh at(float time) const {
    std::size_t k = 0;
    while (k + 2 < keys.size() && times[k + 1] <= time) ++k;
    const std::size_t next = std::min(k + 1, keys.size() - 1);
    const float s = next == k || time <= times[k] ? 0.0f
                    : time >= times[next]         ? 1.0f
                                                  : (time - times[k]) / (times[next] - times[k]);
    Mesh mesh = keys[k];
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis)
        mesh.positions[i][axis] = std::fma(s, keys[next].positions[i][axis], (1.0f - s) * keys[k].positions[i][axis]);
    return mesh;
  }
  Hit closest(const Ray& ray) const {
    using List = PrimitiveList<MovingTriangleSet>;
    using P = Policies<>;
    P::Stack::Memory memory;
    return ClosestHit<P, NoFilter, List>(make_scene_view(*open_buffer(file.bytes())), ray, P::Stack::Storage(memory),
                                         {}, List{set()})
        .next_hit();
  }
};

Deforming twisting_ball() {
  const Mesh ball = oracle::icosphere(3);
  return {{ball, oracle::twisted(ball, 0.2), oracle::shaken(ball, 0.3, kSeed)}, {-1.0f, 0.25f, 3.0f}};
}

Ray aimed_ray(Random& random) {
  Ray ray;
  const auto from = random.on_sphere();
  const auto at = random.in_cube(0.7);
  ray.origin = Vec3(4 * from[0], 4 * from[1], 4 * from[2]);
  ray.direction = Vec3(at[0], at[1], at[2]) - ray.origin;
  ray.time = random.below(6) == 0 ? -1.0f : random.uniform_float(-2, 4);
  return ray;
}

}  // namespace

TEST_CASE("a mesh that deforms is hit as the mesh of that time is, bit by bit") {
  const Deforming deforming = twisting_ball();
  Random random(kSeed);
  unsigned hits = 0;
  for (unsigned i = 0; i < 60; ++i) {
    Ray ray = aimed_ray(random);
    const float time = ray.time;
    const Mesh mesh = deforming.at(time);
    const std::vector<build::TriangleMesh> views{mesh.view()};
    const auto still = build::build(views);
    REQUIRE(still.has_value());
    const SceneView scene = make_scene_view(*open_buffer(still->buffer.bytes()));
    for (unsigned k = 0; k < 50; ++k) {
      INFO("seed " << kSeed << ", time " << i << ", ray " << k);
      const Hit expected = closest_hit<Policies<>>(scene, ray), hit = deforming.closest(ray);
      REQUIRE(hit.found() == expected.found());
      if (hit.found()) {
        ++hits;
        REQUIRE((hit.t == expected.t && hit.u == expected.u && hit.v == expected.v));
        REQUIRE((hit.primitive == expected.primitive && hit.normal == expected.normal));
        REQUIRE(hit.error >= expected.error);
        REQUIRE(hit.error < expected.error + 1e-6f);
      }
      ray = aimed_ray(random);
      ray.time = time;
    }
  }
  CHECK(hits > 1000);
}

TEST_CASE("nothing that deforms leaves its boxes") {
  const Deforming deforming = twisting_ball();
  for (unsigned step = 0; step <= 400; ++step) {
    const Mesh mesh = deforming.at(-1.5f + 0.0125f * static_cast<float>(step));
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
      for (const auto vertex : mesh.triangles[i])
        for (std::size_t axis = 0; axis < 3; ++axis) {
          REQUIRE(deforming.boxes[i].min[axis] <= mesh.positions[vertex][axis]);
          REQUIRE(mesh.positions[vertex][axis] <= deforming.boxes[i].max[axis]);
        }
  }
}

TEST_CASE("no ray passes between triangles that deform, aimed at edges and corners") {
  const Deforming deforming = twisting_ball();
  Random random(kSeed);
  for (unsigned i = 0; i < 20000; ++i) {
    // Out of a closed surface, through a point of an edge as well as floats allow.
    const float time = random.uniform_float(-2, 4);
    const Mesh mesh = deforming.at(time);
    const auto& triangle = mesh.triangles[random.below(static_cast<std::uint32_t>(mesh.triangles.size()))];
    const auto &a = mesh.positions[triangle[0]], &b = mesh.positions[triangle[1]];
    const float w = i % 4 == 0 ? 0.0f : random.uniform_float(0, 1);
    Ray ray;
    ray.direction = Vec3(a[0] + w * (b[0] - a[0]), a[1] + w * (b[1] - a[1]), a[2] + w * (b[2] - a[2]));
    ray.time = time;
    INFO("seed " << kSeed << ", ray " << i);
    REQUIRE(deforming.closest(ray).found());
  }
}

TEST_CASE("one key stands still, and at no time there is nothing") {
  const Deforming still(std::vector<Mesh>{oracle::icosphere(1)}, {5.0f});
  Ray ray{.origin = {0, 0, 3}, .direction = {0.01f, 0.02f, -1}};
  const float first = still.closest(ray).t;
  CHECK(first < 2.1f);
  ray.time = 100;
  CHECK(still.closest(ray).t == first);
  ray.time = std::numeric_limits<float>::quiet_NaN();
  CHECK(still.closest(ray).t == first);
  CHECK_FALSE(twisting_ball().closest(ray).found());
}
