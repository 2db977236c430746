// Windows of coherent rays, which closest_hits() and any_hits() trace at once: each ray has the hit of a single ray.

#include <hiprt_build/trace_rays.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/amount.h>
#include <tests/host/soups.h>
#include <tests/traversal/tracers.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 2611;
/// Rays that are looked at together.
constexpr std::size_t kWindow = 8;

/// Rays from one point, or from points near each other, to points of a small disk.
std::vector<Ray> beam(Random& random, double scale, float origin_spread) {
  const Position eye = random.in_cube(3.0 * scale), target = random.in_cube(scale);
  std::vector<Ray> rays(kWindow);
  for (Ray& ray : rays) {
    const Position aside = random.in_cube(0.1 * scale),
                   moved = random.in_cube(static_cast<double>(origin_spread) * scale);
    for (std::size_t k = 0; k < 3; ++k) {
      ray.origin[static_cast<int>(k)] = eye[k] + moved[k];
      ray.direction[static_cast<int>(k)] = target[k] + aside[k] - eye[k];
    }
  }
  return rays;
}

/// Whether closest_hits() may trace the rays at once.
bool is_coherent(std::span<const Ray> rays) {
  const auto dominant = [](const Ray& ray) {
    const Vec3 d = ray.direction;
    return std::abs(d.x) > std::abs(d.y) ? (std::abs(d.x) > std::abs(d.z) ? 0 : 2)
                                         : (std::abs(d.y) > std::abs(d.z) ? 1 : 2);
  };
  for (const Ray& ray : rays) {
    if (dominant(ray) != dominant(rays[0])) return false;
    for (int k = 0; k < 3; ++k)
      if (std::signbit(ray.direction[k]) != std::signbit(rays[0].direction[k])) return false;
  }
  return true;
}

/// @return windows that were coherent.
unsigned check_windows(const SceneView& scene, const std::vector<Ray>& rays) {
  std::vector<Hit> hits(rays.size()), any(rays.size());
  REQUIRE(closest_hits(scene, rays, hits));
  REQUIRE(any_hits(scene, rays, any));
  unsigned coherent = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    INFO("ray " << i);
    const Hit expected = closest_hit<Policies>(scene, rays[i]);
    INFO("t " << hits[i].t << ", expected " << expected.t << "; primitive " << hits[i].primitive << ", expected "
              << expected.primitive);
    REQUIRE(same_hit(hits[i], expected));
    REQUIRE(any[i].found() == expected.found());
    if (any[i].found()) REQUIRE((any[i].t >= std::max(rays[i].tmin, 0.0f) && any[i].t <= rays[i].tmax));
    if (i % kWindow == 0 && i + kWindow <= rays.size()) coherent += is_coherent(std::span(rays).subspan(i, kWindow));
  }
  return coherent;
}

/// A height field over integers: a vertex (x, y, (x * y) % 3), two triangles per square.
Mesh lattice(unsigned size) {
  Mesh mesh;
  for (unsigned y = 0; y < size; ++y)
    for (unsigned x = 0; x < size; ++x)
      mesh.positions.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(x * y % 3)});
  for (unsigned y = 0; y + 1 < size; ++y)
    for (unsigned x = 0; x + 1 < size; ++x) {
      const unsigned a = y * size + x;
      mesh.triangles.push_back({a, a + 1, a + size});
      mesh.triangles.push_back({a + 1, a + size + 1, a + size});
    }
  return mesh;
}

}  // namespace

TEST_CASE("Beams of coherent rays have the hits of single rays") {
  INFO("seed " << kSeed);
  Random random(kSeed);
  for (const double size : {0.02, 0.3}) {
    const std::vector<Mesh> meshes{soup(random, 2000, size), soup(random, 200, size)};
    const Scene scene = make_scene(meshes, {.max_leaf_triangles = size < 0.1 ? 4u : 64u});
    unsigned coherent = 0;
    const unsigned beams = trials(1500);
    for (unsigned i = 0; i < beams; ++i) {
      INFO("beam " << i << ", triangles of " << size);
      std::vector<Ray> rays = beam(random, 1.0, i % 3 == 0 ? 0.02f : 0.0f);
      for (Ray& ray : rays) {
        if (random.below(4) == 0) ray.tmax = random.uniform_float(0.0, 1.2);
        if (random.below(4) == 0) ray.tmin = random.uniform_float(-0.5, 1.2);
        if (random.below(200) == 0) ray.tmax = -0.0f;
        if (random.below(200) == 0) ray.tmin = 2.0f * ray.tmax;
        if (random.below(200) == 0) ray.mask = 0;
        if (random.below(200) == 0) ray.direction.y = std::numeric_limits<float>::quiet_NaN();
      }
      coherent += check_windows(scene.traced, rays);
    }
    CHECK(coherent > beams / 2);
  }
}

TEST_CASE("Coherent rays through vertices and edges have the hits of single rays") {
  const unsigned size = 40;
  // The same field twice: all hits are ties.
  const std::vector<Mesh> meshes{lattice(size), lattice(size)};
  const Scene scene = make_scene(meshes);
  for (const float z : {64.0f, -64.0f}) {
    std::vector<Ray> rays;
    for (unsigned y = 0; y < size; ++y)
      for (unsigned x = 0; x < size; ++x) {
        // Of every second row the middles of edges.
        const Vec3 to(static_cast<float>(x) + (y % 2 == 0 ? 0.0f : 0.5f), static_cast<float>(y),
                      static_cast<float>(x * y % 3));
        Ray ray;
        ray.origin = Vec3(-32.0f, -16.0f, z);
        ray.direction = to - ray.origin;
        rays.push_back(ray);
      }
    CHECK(check_windows(scene.traced, rays) > rays.size() / kWindow / 2);
    // Along an axis: two components are 0.
    for (Ray& ray : rays) {
      ray.origin = Vec3(ray.origin.x + ray.direction.x, ray.origin.y + ray.direction.y, z);
      ray.direction = Vec3(0.0f, 0.0f, -z);
    }
    CHECK(check_windows(scene.traced, rays) > rays.size() / kWindow / 2);
  }
}

TEST_CASE("Coherent rays see only the geometries of their masks") {
  INFO("seed " << kSeed);
  Random random(kSeed + 1);
  std::vector<Mesh> meshes;
  for (unsigned i = 0; i < 4; ++i) {
    meshes.push_back(soup(random, 500, 0.2));
    meshes.back().mask = 1u << i;
  }
  const Scene scene = make_scene(meshes);
  for (unsigned i = 0; i < trials(500); ++i) {
    INFO("beam " << i);
    std::vector<Ray> rays = beam(random, 1.0, 0.0f);
    for (Ray& ray : rays) ray.mask = random.below(16);
    check_windows(scene.traced, rays);
  }
}

TEST_CASE("Coherent rays have the hits of single rays at every size and place of the guarantees") {
  INFO("seed " << kSeed);
  Random random(kSeed + 2);
  const Mesh mesh = soup(random, 500, 0.2);
  for (const double scale : {1e-29, 1e-20, 1e-6, 1e6, 1e17}) {
    const Scene scene = make_scene({placed(mesh, scale)});
    for (unsigned i = 0; i < trials(300); ++i) {
      INFO("scale " << scale << ", beam " << i);
      check_windows(scene.traced, beam(random, scale, 0.01f));
    }
  }
  // Beyond the range of the guarantees (ray.h) rays may miss. They end.
  for (const double scale : {1e-44, 1e-38, 1e37}) {
    const Scene scene = make_scene({placed(mesh, scale)});
    for (unsigned i = 0; i < trials(300); ++i) {
      const std::vector<Ray> rays = beam(random, scale, 0.01f);
      std::vector<Hit> hits(rays.size());
      REQUIRE(closest_hits(scene.traced, rays, hits));
      for (const Hit& hit : hits) REQUIRE_FALSE(hit.failed());
    }
  }
  const Scene far = make_scene({placed(mesh, 1.0, {1e6, -1e5, 1e4})});
  for (unsigned i = 0; i < trials(300); ++i) {
    std::vector<Ray> rays = beam(random, 1.0, 0.01f);
    for (Ray& ray : rays) ray.origin += Vec3(1e6f, -1e5f, 1e4f);
    check_windows(far.traced, rays);
  }
}
