// Extreme scenes and rays on a GPU: hits equal the host's, bit for bit, and exact arithmetic confirms them.

#include <tests/gpu/extremes.h>

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/scene.h>
#include <tests/gpu/results.h>
#include <tests/oracle/brute_force.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/oracle/ray_beside.h>

#include <tests/catch.h>

#include <array>
#include <bit>
#include <limits>

using namespace hiprt;
using namespace hiprt::checks;
using oracle::Corners, oracle::Mesh, oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261123;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();

struct Extreme {
  std::string name;
  Mesh mesh;
  double size;             ///< Approximate size of the target,
  oracle::Double3 center;  ///< and where it is.
};

/// A ball of radius 1e-3 over a ground of 1e6.
Mesh teapot_in_a_stadium() {
  Mesh mesh = oracle::placed(oracle::grid_plane(4, 2, 0.0f), 1e6);
  append(mesh, oracle::placed(oracle::icosphere(1), 1e-3, {0, 0, 2e-3}));
  return mesh;
}

std::vector<Extreme> extremes() {
  const Mesh star = oracle::star(2, 11), sphere = oracle::icosphere(2);
  std::vector<Extreme> result{{"star", star, 1, {0, 0, 0}},
                              {"at 1e3", oracle::placed(sphere, 10, {1e3, -1e3, 1e3}), 10, {1e3, -1e3, 1e3}},
                              {"at 1e7", oracle::placed(sphere, 1e3, {1e7, 1e7, -1e7}), 1e3, {1e7, 1e7, -1e7}},
                              {"needles", oracle::needles(100, 1e7, 1), 1, {0, 0, 0}},
                              {"slivers", oracle::slivers(100, 1e-6, 2), 1, {0, 0, 0}},
                              {"torture", oracle::torture(200, 3), 1, {0, 0, 0}},
                              {"identical", oracle::identical(33), 1, {0, 0, 0}},
                              {"concentric", oracle::concentric(63, 4), 1, {0, 0, 0}},
                              {"stadium", teapot_in_a_stadium(), 1e-3, {0, 0, 2e-3}},
                              {"one triangle", oracle::identical(1), 1, {0, 0, 0}},
                              {"nothing", Mesh{}, 1, {0, 0, 0}}};
  for (const double size : {1e-20, 1e-15, 1e15, 1e18})
    result.push_back({"size " + std::to_string(size), oracle::placed(star, size), size, {0, 0, 0}});
  return result;
}

/// A corner, a point of an edge or, without triangles, the centre.
Vec3 target(const Extreme& extreme, Random& random) {
  if (extreme.mesh.triangles.empty()) return oracle::vec3(oracle::rounded(extreme.center));
  const auto count = static_cast<std::uint32_t>(extreme.mesh.triangles.size());
  const Corners c = oracle::corners(extreme.mesh, random.below(count));
  const float s = random.coin() ? 0.0f : random.uniform_float(0, 1);
  Vec3 p;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    p[k] = c.p0[i] + s * (c.p1[i] - c.p0[i]);
  }
  return p;
}

/// A point up to four sizes away from the target.
Vec3 origin_around(const Extreme& extreme, Random& random) {
  const auto away = random.on_sphere();
  const double distance = extreme.size * random.uniform(0.0, 4.0);
  Vec3 origin;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    origin[k] = static_cast<float>(extreme.center[i] + distance * away[i]);
  }
  return origin;
}

/// Makes a ray invalid: NaN or infinity in the origin or direction, NaN in the range, or hardly any direction.
void break_ray(Ray& ray, unsigned kind, int axis, Random& random) {
  if (kind == 0) ray.origin[axis] = random.coin() ? kNan : kInfinity;
  if (kind == 1) ray.direction[axis] = random.coin() ? kNan : -kInfinity;
  if (kind == 2) (random.coin() ? ray.tmin : ray.tmax) = kNan;
  if (kind == 3) ray.direction = random.coin() ? Vec3(0.0f) : Vec3(1e-42f);
}

/// A ray of one of twelve kinds: at an edge or a corner, along an axis, with an extreme length or range, or invalid.
Ray odd_ray(const Extreme& extreme, unsigned kind, Random& random) {
  Ray ray;
  ray.origin = origin_around(extreme, random);
  const Vec3 at = target(extreme, random);
  ray.direction = at - ray.origin;
  const int axis = static_cast<int>(random.below(3));
  switch (kind % 12) {
    case 0:  // Along an axis, in the planes of boxes.
      ray.origin = at;
      ray.origin[axis] -= static_cast<float>(2 * extreme.size);
      ray.direction = Vec3(random.coin() ? 0.0f : -0.0f);
      ray.direction[axis] = 1.0f;
      break;
    case 1:
      ray.direction[axis] = -0.0f;
      break;
    case 2:
      ray.direction = ray.direction / static_cast<float>(extreme.size) * (random.coin() ? 1e-18f : 1e18f);
      break;
    case 3:  // On the surface.
      ray.origin = at;
      ray.direction = oracle::vec3(random.in_cube(1.0));
      break;
    case 4:
      ray.tmin = ray.tmax = 1.0f;
      break;
    case 5:
      ray.tmin = random.uniform_float(-1, 2), ray.tmax = random.uniform_float(-1, 2);
      break;
    default:  // Invalid up to 9; then unchanged.
      break_ray(ray, kind % 12 - 6, axis, random);
      break;
  }
  return ray;
}

/// Where the line of ray_beside.h, an infinitesimal distance beside the ray, passes through the triangle.
/// @return t rounded to the nearest float; NaN outside of [tmin, tmax] or when the line misses.
float passes_at(const Ray& ray, const Corners& corners) {
  Ray whole = ray;
  whole.tmin = 0.0f;
  whole.tmax = kInfinity;
  if (!oracle::is_finite(corners) || !oracle::passes_beside(ray, corners)) return kNan;
  if (!oracle::decide_in_integers(whole, corners).hit) return kNan;
  const float t = oracle::nearest_float(oracle::exact_point(ray, corners).t);
  return std::isfinite(t) && t >= oracle::effective_tmin(ray) && t <= ray.tmax ? t : kNan;
}

/// Judges what Reference says of a ray. Ties are the lowest primitive's.
void judge_reference(const Mesh& mesh, const Ray& ray, const Hit& hit) {
  float nearest = kInfinity;
  std::uint32_t best = kInvalidId;
  for (std::uint32_t i = 0; oracle::is_valid(ray) && i < mesh.triangles.size(); ++i)
    if (const float t = passes_at(ray, oracle::corners(mesh, i)); t < nearest) nearest = t, best = i;
  REQUIRE(hit.primitive == best);
  REQUIRE(hit.t == nearest);
}

/// What holds of every hit.
void judge(const Ray& ray, const Hit& hit) {
  REQUIRE_FALSE(hit.failed());
  if (!hit.found()) return;
  REQUIRE(oracle::is_valid(ray));
  REQUIRE(std::isfinite(hit.t));
  REQUIRE(hit.t >= oracle::effective_tmin(ray));
  REQUIRE(hit.t <= ray.tmax);
  // Up to rounding.
  for (const float x : {hit.u, hit.v}) REQUIRE((x >= -0x1p-24f && x <= 1.0f + 0x1p-23f));
}

bool same_bits(const Hit& a, const Hit& b) {
  using Words = std::array<std::uint32_t, sizeof(Hit) / sizeof(std::uint32_t)>;
  return std::bit_cast<Words>(a) == std::bit_cast<Words>(b);
}

}  // namespace

TEST_CASE("extreme scenes and rays: hits equal the host's bits and those of exact arithmetic") {
  constexpr unsigned kRays = 240;
  unsigned hits = 0;
  for (const Extreme& extreme : extremes()) {
    const build::TriangleMesh mesh = extreme.mesh.view();
    const build::Bvh bvh = must(build::build({&mesh, 1}));
    Random random(kSeed);
    std::vector<Ray> rays;
    for (unsigned i = 0; i < kRays; ++i) rays.push_back(odd_ray(extreme, i, random));
    gpu::DeviceAllocator allocator;
    const auto scene = must(gpu::upload_scene(bvh.buffer.bytes(), nullptr, allocator));
    const auto found = must(trace_extremes_on_device(scene.view, rays));
    const auto expected = trace_extremes(make_scene_view(*open_buffer(bvh.buffer.bytes())), rays);
    for (unsigned i = 0; i < kRays; ++i) {
      INFO("seed " << kSeed << ", " << extreme.name << ", ray " << i << ", kind " << i % 12);
      REQUIRE(same_bits(found[i].closest, expected[i].closest));
      REQUIRE(same_bits(found[i].reference, expected[i].reference));
      REQUIRE(found[i].any == (found[i].closest.found() ? 1u : 0u));
      judge(rays[i], found[i].closest);
      judge(rays[i], found[i].reference);
      judge_reference(extreme.mesh, rays[i], found[i].reference);
      hits += found[i].closest.found() ? 1 : 0;
    }
  }
  CHECK(hits > 500);
}
