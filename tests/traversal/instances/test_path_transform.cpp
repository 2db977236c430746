// Transforms along paths of still and moving instances: errors against long double, and their bounds.

#include <hiprt_device/math/vec_functions.h>
#include <tests/traversal/instances/moving_scenes.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261123;
constexpr unsigned kMost = 4;

Real3 operator-(const Real3& a, const Real3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Real3 cross(const Real3& a, const Real3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Real dot3(const Real3& a, const Real3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Real3 real(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

/// One instance inside the other; the instance path is 0, 0, ...
struct Chain : InstanceScene {
  std::vector<std::unique_ptr<build::Motion>> motions;

  Chain(Random& random, unsigned levels, bool moves, double spread) {
    add_file({oracle::icosphere(0)}, NodeLayout::kPlanes);
    for (unsigned level = 0; level < levels; ++level) {
      motions.push_back(std::make_unique<build::Motion>(
          random_motion(random, static_cast<MotionKind>(1 + random.below(3)), moves ? 3 : 1, spread)));
      groups.push_back({{.object = level, .to_scene = random_affine(random, spread)}});
      if (moves) groups.back()[0].motion = motions.back().get();
    }
    build();
  }

  /// A point of the object in the scene, exactly. For static instances it uses the file's records.
  Real3 to_scene(const SceneView& view, float time, bool moves, Real3 p) const {
    std::vector<InstanceRecord> records;
    follow(view, path(), time,
           [&](const InstanceRecord& r, const ObjectRecord&, const MotionRecord*) { records.push_back(r); });
    for (std::size_t level = 0; level < groups.size(); ++level) {
      if (moves) {
        p = moved(*motions[level], time, p);
        continue;
      }
      const InstanceRecord& record = records[groups.size() - 1 - level];
      Real3 row[3];
      for (unsigned r = 0; r < 3; ++r) row[r] = {record.linear[r][0], record.linear[r][1], record.linear[r][2]};
      const Real determinant = dot3(row[0], cross(row[1], row[2]));
      const Real3 c0 = cross(row[1], row[2]), c1 = cross(row[2], row[0]), c2 = cross(row[0], row[1]);
      Real3 x;
      for (unsigned i = 0; i < 3; ++i)
        x[i] = (c0[i] * p[0] + c1[i] * p[1] + c2[i] * p[2]) / determinant + Real{record.translation[i]};
      p = x;
    }
    return p;
  }
  InstancePath<kMost> path() const {
    InstancePath<kMost> path;
    path.depth = static_cast<std::uint32_t>(groups.size());
    return path;
  }
};

/// The largest part of a bound that an error takes up.
double part_of(const Bounded& is, const Real3& exact) {
  const float value[3] = {is.value.x, is.value.y, is.value.z};
  double worst = 0.0;
  for (unsigned i = 0; i < 3; ++i) {
    const auto off = static_cast<double>(std::fabs(Real{value[i]} - exact[i]));
    worst = std::max(worst, off == 0.0 ? 0.0 : off / static_cast<double>(is.error));
  }
  return worst;
}

/// Rounded, with what that is off by.
Bounded rounded(const Real3& exact) {
  Bounded result{Vec3(static_cast<float>(exact[0]), static_cast<float>(exact[1]), static_cast<float>(exact[2]))};
  const float value[3] = {result.value.x, result.value.y, result.value.z};
  for (unsigned i = 0; i < 3; ++i)
    result.error = std::max(result.error, 1.0001f * static_cast<float>(std::fabs(Real{value[i]} - exact[i])));
  return result;
}

}  // namespace

TEST_CASE("points, directions and normals along instance paths are within their errors") {
  Random random(kSeed);
  for (const bool moves : {false, true}) {
    double worst[6] = {};
    for (unsigned i = 0; i < 400; ++i) {
      const Chain scene(random, 1 + i % kMost, moves, i % 3 == 0 ? 1e4 : 2.0);
      const SceneView view = scene.view();
      for (unsigned k = 0; k < 20; ++k) {
        const float time = random.uniform_float(-3, 6);
        const PathTransform transform(view, scene.path(), time);
        const auto at = [&](const Real3& x) { return scene.to_scene(view, time, moves, x); };
        const Real3 p = real(random.in_cube(2)), v = real(random.in_cube(1)), w = real(random.in_cube(1));
        const Real3 origin = at({0, 0, 0}), p_out = at(p), v_out = at(v) - origin, w_out = at(w) - origin;
        // cross(M v, M w) = det(M) * transpose(inverse(M)) * cross(v, w).
        const Real3 ex = at({1, 0, 0}) - origin, ey = at({0, 1, 0}) - origin, ez = at({0, 0, 1}) - origin;
        const Real determinant = dot3(ex, cross(ey, ez));
        const Real3 n = cross(v, w);
        Real3 n_out = cross(v_out, w_out);
        for (Real& x : n_out) x /= determinant;
        const Bounded results[6] = {
            transform.point_to_scene(rounded(p)),       transform.vector_to_scene(rounded(v)),
            transform.normal_to_scene(rounded(n)),      transform.point_to_object(rounded(p_out)),
            transform.vector_to_object(rounded(v_out)), transform.normal_to_object(rounded(n_out))};
        const Real3 exact[6] = {p_out, v_out, n_out, p, v, n};
        for (unsigned a = 0; a < 6; ++a) {
          INFO("seed " << kSeed << ", chain " << i << ", " << k << ", transform " << a << (moves ? ", moving" : ""));
          REQUIRE(part_of(results[a], exact[a]) <= 1.0);
          worst[a] = std::max(worst[a], part_of(results[a], exact[a]));
        }
      }
    }
    std::printf("of their bounds, %s: point %.3f, vector %.3f, normal %.3f; back %.3f, %.3f, %.3f\n",
                moves ? "moving" : "still", worst[0], worst[1], worst[2], worst[3], worst[4], worst[5]);
    for (const double part : worst) CHECK(part > 0.01);
  }
}

TEST_CASE("transforms to the scene and back change points and directions by rounding only") {
  Random random(kSeed);
  for (unsigned i = 0; i < 3000; ++i) {
    InstanceRecord record{};
    const Affine affine = random_affine(random, 10);
    for (unsigned r = 0; r < 3; ++r) {
      std::copy_n(affine.row[r], 3, record.linear[r]);
      record.translation[r] = affine.row[r][3];
    }
    const auto cube = random.in_cube(3);
    const Vec3 p(cube[0], cube[1], cube[2]);
    const float close = 1e-5f;
    CHECK(max_component(point_to_object(record, point_to_scene(record, p)) - p) < 10 * close);
    CHECK(max_component(vector_to_object(record, vector_to_scene(record, p)) - p) < close);
    CHECK(max_component(normal_to_object(record, normal_to_scene(record, p)) - p) < close);
    // A normal stays orthogonal to the same directions.
    const Vec3 along(p.y, -p.x, 0), n = normal_to_scene(record, p), v = vector_to_scene(record, along);
    CHECK(absolute(glm::dot(n, v)) < 1e-4f * (1 + max_component(n) * max_component(v)));
  }
}

TEST_CASE("an empty instance path is the identity") {
  Random random(kSeed);
  const Chain scene(random, 1, false, 1.0);
  const PathTransform<1> transform(scene.view(), InstancePath<1>{});
  const Bounded p = transform.point_to_scene({Vec3(1, 2, 3), 0.5f});
  CHECK((p.value == Vec3(1, 2, 3) && p.error == 0.5f));
  CHECK(transform.normal_to_object({Vec3(1, 2, 3)}).value == Vec3(1, 2, 3));
}
