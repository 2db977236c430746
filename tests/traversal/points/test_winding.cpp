// Winding numbers against the sum of all triangles in long double, of closed, open and messy meshes.

#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/points/point_queries.h>

#include <hiprt_build/instances.h>
#include <hiprt_build/winding.h>
#include <hiprt_device/query/inside.h>
#include <hiprt_device/query/winding_number.h>

#include <tests/catch.h>

#include <cmath>
#include <cstring>
#include <numbers>

using namespace hiprt;
using namespace hiprt::checks;
using build::WindingArrays;
using Catch::Contains;

namespace {

constexpr std::uint64_t kSeed = 20261127;
constexpr double kExact = std::numeric_limits<double>::infinity();

using Long3 = std::array<long double, 3>;

long double dot(const Long3& a, const Long3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Long3 from(const Vec3D& p, const Position& corner) { return {corner[0] - p.x, corner[1] - p.y, corner[2] - p.z}; }

/// The solid angle of a triangle over 4 pi.
long double turns(const Vec3D& p, const Corners& t) {
  const Long3 a = from(p, t.p0), b = from(p, t.p1), c = from(p, t.p2);
  const Long3 cross{b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]};
  const long double la = std::sqrt(dot(a, a)), lb = std::sqrt(dot(b, b)), lc = std::sqrt(dot(c, c));
  const long double x = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
  return std::atan2(dot(a, cross), x) / (2 * std::numbers::pi_v<long double>);
}

double expected_number(const std::vector<Mesh>& meshes, const Vec3D& p) {
  long double sum = 0;
  for (const Mesh& mesh : meshes)
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
      if (const Corners c = corners(mesh, i); !oracle::is_dropped(c)) sum += turns(p, c);
  return static_cast<double>(sum);
}

WindingArrays arrays_of(const Scene& scene, std::uint32_t mask = 0xffffffffu, unsigned threads = 0) {
  auto arrays = build::winding_arrays(scene.view, mask, threads);
  INFO((arrays ? std::string() : arrays.error().message));
  REQUIRE(arrays.has_value());
  return std::move(*arrays);
}

/// A sphere with a hole.
Mesh bowl() { return oracle::first_triangles(icosphere(3), 900); }

Mesh moved(Mesh mesh, float scale, const Position& by) {
  for (Position& p : mesh.positions)
    for (std::size_t k = 0; k < 3; ++k) p[k] = p[k] * scale + by[k];
  return mesh;
}

struct Case {
  std::string name;
  std::vector<Mesh> meshes;
  double size;  ///< Of the region to ask in.
};
std::vector<Case> cases() {
  return {{"sphere", {icosphere(3)}, 1.5},
          {"bowl", {bowl()}, 1.5},
          {"two spheres and a star", {icosphere(2), moved(icosphere(2), 1, {0.7f, 0, 0}), star(3, 5)}, 1.8},
          {"soup", {oracle::soup(700, 0.5, 3)}, 1.5},
          {"needles", {oracle::needles(300, 1e4, 4)}, 1.5},
          {"junctions", {oracle::with_t_junctions(star(3, 6), 7)}, 1.2},
          {"tiny", {moved(star(3, 8), 1e-30f, {0, 0, 0})}, 1.5e-30},
          {"huge", {moved(star(3, 8), 1e30f, {0, 0, 0})}, 1.5e30},
          {"one triangle", {oracle::first_triangles(icosphere(0), 1)}, 1.5}};
}

/// Points everywhere, and some near the surface.
Vec3D point_of(const Case& c, Random& random) {
  if (random.below(3) != 0) {
    const Position p = random.in_cube(1);
    return Vec3D(p[0], p[1], p[2]) * c.size;
  }
  return Vec3D(point_near(c.meshes[0], random, c.size, {0, 0, 0}));
}

}  // namespace

TEST_CASE("winding numbers are within their errors of the sum over all triangles, for every builder and accuracy") {
  Sample sample(3);
  for (const Case& c : cases())
    for (const build::Builder builder : {build::Builder::kSbvh, build::Builder::kLbvh, build::Builder::kHploc})
      for (const NodeLayout layout : {NodeLayout::kPlanes, NodeLayout::kFloat}) {
        if (!sample.next()) continue;
        const Scene scene = make_scene(c.meshes, {.builder = builder, .nodes = layout});
        const WindingArrays arrays = arrays_of(scene);
        Random random(kSeed);
        for (unsigned i = 0; i < trials(600); ++i) {
          const Vec3D point = point_of(c, random);
          INFO(c.name << ", " << build::name(builder) << ", seed " << kSeed << ", point " << i);
          const double expected = expected_number(c.meshes, point);
          for (const double accuracy : {2.0, 4.0, 8.0, 16.0, kExact}) {
            const WindingNumber number = winding_number(arrays.tree(), point, accuracy);
            REQUIRE(std::abs(number.value - expected) <= number.error + 1e-12);
          }
        }
      }
}

TEST_CASE("errors of winding numbers are small beside the surface's size, and fall with the accuracy") {
  const Case sphere{"sphere", {icosphere(4)}, 1.5};
  const WindingArrays arrays = arrays_of(make_scene(sphere.meshes));
  double bound[4] = {}, actual[4] = {};
  Random random(kSeed);
  constexpr unsigned kPoints = 300;
  for (unsigned i = 0; i < kPoints; ++i) {
    const Position p = random.in_cube(1.5);
    const Vec3D point(p[0], p[1], p[2]);
    const double expected = expected_number(sphere.meshes, point);
    for (unsigned k = 0; k < 4; ++k) {
      const WindingNumber number = winding_number(arrays.tree(), point, std::ldexp(2.0, static_cast<int>(k)));
      bound[k] += number.error / kPoints;
      actual[k] += std::abs(number.value - expected) / kPoints;
    }
  }
  // The series' first missing term is 3 / accuracy^2 of each part's share.
  for (unsigned k = 1; k < 4; ++k) {
    INFO("accuracy " << (2 << k) << ": bound " << bound[k] << ", error " << actual[k]);
    CHECK(bound[k] < 5.0 / std::ldexp(4.0, static_cast<int>(2 * k)));
    CHECK(bound[k] < bound[k - 1] / 2);
    CHECK(actual[k] < bound[k] / 4);
  }
}

TEST_CASE("the numbers of closed meshes are whole: 1 inside, 0 outside, -1 if turned inside out, 2 in two of them") {
  Mesh out = icosphere(3), turned = out;
  for (build::Triangle& t : turned.triangles) std::swap(t[1], t[2]);
  const WindingArrays one = arrays_of(make_scene({out})), inverse = arrays_of(make_scene({turned})),
                      two = arrays_of(make_scene({out, moved(out, 2, {0, 0, 0})}));
  Random random(kSeed);
  for (unsigned i = 0; i < trials(1000); ++i) {
    const auto unit = random.on_sphere();
    const double radius = random.uniform(0, 3);
    if (std::abs(radius - 0.99) < 0.02 || std::abs(radius - 1.98) < 0.04) continue;
    const Vec3D point = Vec3D(unit[0], unit[1], unit[2]) * radius;
    INFO("seed " << kSeed << ", point " << i);
    const auto number = [&](const WindingArrays& arrays) { return winding_number(arrays.tree(), point, kExact).value; };
    const double inside = radius < 1 ? 1 : 0;
    CHECK(std::abs(number(one) - inside) < 1e-12);
    CHECK(std::abs(number(inverse) + inside) < 1e-12);
    CHECK(std::abs(number(two) - inside - (radius < 2 ? 1 : 0)) < 1e-12);
    CHECK(is_inside(one.tree(), point) == (radius < 1 ? Side::kInside : Side::kOutside));
    CHECK(is_inside(inverse.tree(), point) == Side::kOutside);
    CHECK(is_inside(two.tree(), point) == (radius < 2 ? Side::kInside : Side::kOutside));
  }
}

TEST_CASE("insides by winding numbers are those of crossings for closed meshes, and a half of the number for others") {
  for (const Case& c : cases()) {
    const Scene scene = make_scene(c.meshes);
    const WindingArrays arrays = arrays_of(scene);
    Random random(kSeed + 1);
    unsigned decided = 0;
    for (unsigned i = 0; i < trials(1500); ++i) {
      const Vec3D point(Vec3(point_of(c, random)));
      const double expected = expected_number(c.meshes, point);
      // On the surface it is either.
      const WindingNumber exact = winding_number(arrays.tree(), point, kExact);
      if (std::abs(exact.value - 0.5) <= exact.error + 1e-9) continue;
      ++decided;
      INFO(c.name << ", seed " << kSeed + 1 << ", point " << i << ", number " << expected);
      const Side side = is_inside(arrays.tree(), point);
      REQUIRE(side == (expected > 0.5 ? Side::kInside : Side::kOutside));
      if (c.name == "sphere" || c.name == "junctions") REQUIRE(side == is_inside(scene.traced, Vec3(point)));
    }
    CHECK(decided > trials(1500) * 3 / 4);
  }
}

TEST_CASE("winding numbers at corners, edges and faces lie between both sides, within their errors") {
  const Mesh mesh = icosphere(2);
  const WindingArrays arrays = arrays_of(make_scene({mesh}));
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Corners c = corners(mesh, i);
    const Vec3D a = vec3d(c.p0), b = vec3d(c.p1), d = vec3d(c.p2);
    for (const Vec3D& point : {a, (a + b) * 0.5, (a + b + d) * (1.0 / 3)}) {
      const WindingNumber number = winding_number(arrays.tree(), point, kExact);
      CHECK(number.value + number.error >= 0.0);
      CHECK(number.value - number.error <= 1.0);
      CHECK(is_inside(arrays.tree(), point) != Side::kUnknown);
    }
  }
}

TEST_CASE("points that are not finite or too far have no winding number; nothing encloses anything") {
  const WindingArrays sphere = arrays_of(make_scene({icosphere(1)})), none = arrays_of(make_scene({Mesh{}}));
  CHECK(none.nodes.empty());
  CHECK(winding_number(none.tree(), {1, 2, 3}).value == 0);
  CHECK(winding_number(WindingTree{}, {0, 0, 0}).value == 0);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {kNan, kExact, -kExact, 1e300, 0x1p200})
    for (int axis = 0; axis < 3; ++axis) {
      Vec3D point(0.0);
      point[axis] = bad;
      const WindingNumber number = winding_number(sphere.tree(), point);
      CHECK((number.value == 0 && number.error == kExact));
      CHECK(is_inside(sphere.tree(), point) == Side::kOutside);
    }
  for (const double accuracy : {kNan, -1.0, 0.0, 1.0})
    CHECK(winding_number(sphere.tree(), {0.1, 0.2, 3}, accuracy).error ==
          winding_number(sphere.tree(), {0.1, 0.2, 3}, 2.0).error);
  const WindingNumber far = winding_number(sphere.tree(), {0x1p199, 0, 0});
  CHECK((far.value == 0 && far.error < 1e-9));
}

TEST_CASE("winding arrays have each triangle once, for any number of threads, of the geometries that a mask shows") {
  Mesh low = icosphere(3), high = moved(icosphere(3), 1, {0, 0, 3});
  low.mask = 1;
  high.mask = 2;
  const Scene scene = make_scene({low, high}, {.builder = build::Builder::kSbvh});
  const WindingArrays both = arrays_of(scene), one = arrays_of(scene, 0xffffffffu, 1), upper = arrays_of(scene, 2);
  CHECK(both.triangles.size() == low.triangles.size() + high.triangles.size());
  const auto same = [](const auto& a, const auto& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0;
  };
  CHECK((same(both.nodes, one.nodes) && same(both.triangles, one.triangles)));
  CHECK(upper.triangles.size() == high.triangles.size());
  CHECK((is_inside(both.tree(), {0, 0, 0}) == Side::kInside && is_inside(both.tree(), {0, 0, 3}) == Side::kInside));
  CHECK((is_inside(upper.tree(), {0, 0, 0}) == Side::kOutside && is_inside(upper.tree(), {0, 0, 3}) == Side::kInside));
  CHECK(arrays_of(scene, 4).nodes.empty());
}

TEST_CASE("winding arrays of instances and of custom primitives are refused with the reason") {
  const Scene object = make_scene({icosphere(0)});
  const std::vector<std::span<const std::byte>> files{object.bvh.buffer.bytes()};
  const std::vector<build::Instance> one{{.object = 0}};
  const std::vector<std::span<const build::Instance>> groups{one};
  const auto scene = build::build_instances(build::InstancedScene{files, groups});
  REQUIRE(scene.has_value());
  const auto refused = build::winding_arrays(*open_buffer(scene->buffer.bytes()));
  REQUIRE(!refused);
  CHECK(refused.error().code == build::ErrorCode::kInvalidInput);
  CHECK_THAT(refused.error().message, Contains("this file has instances"));
  const std::vector<Box> boxes{{{0, 0, 0}, {1, 1, 1}}};
  const std::vector<build::CustomGeometry> customs{{.boxes = boxes}};
  const auto shapes = build::build(build::SceneInput{.customs = customs});
  REQUIRE(shapes.has_value());
  const auto custom = build::winding_arrays(*open_buffer(shapes->buffer.bytes()));
  CHECK_THAT(custom.error().message, Contains("custom primitives"));
}

TEST_CASE("winding numbers have the same bits under every compiler, set of instructions and contraction") {
  const WindingArrays arrays = arrays_of(make_scene({star(3, 5)}, {.builder = build::Builder::kLbvh}));
  Random random(kSeed);
  std::uint64_t digest = 0xcbf29ce484222325u;
  for (unsigned i = 0; i < 2000; ++i) {
    const Position p = random.in_cube(1.2);
    for (const double accuracy : {4.0, kExact}) {
      const WindingNumber number = winding_number(arrays.tree(), {p[0], p[1], p[2]}, accuracy);
      for (const double x : {number.value, number.error})
        digest = (digest ^ std::bit_cast<std::uint64_t>(x)) * 0x100000001b3u;
    }
  }
  CHECK(digest == 0x7033f087922df0cfu);
}
