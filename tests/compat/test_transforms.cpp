// HIPRT's transform queries, against matrices in double.

#include <tests/compat/instances.h>

using namespace hiprt;
using namespace hiprt::test;

namespace {

using Double3 = std::array<double, 3>;

/// A matrix in double, from the object to the world.
struct Matrix {
  double m[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};

  Matrix() = default;
  explicit Matrix(const build::Affine& affine) {
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 4; ++c) m[r][c] = affine.row[r][c];
  }
  /// Applies the inner one first.
  Matrix operator*(const Matrix& inner) const {
    Matrix result;
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 4; ++c) {
        result.m[r][c] = c == 3 ? m[r][3] : 0.0;
        for (unsigned k = 0; k < 3; ++k) result.m[r][c] += m[r][k] * inner.m[k][c];
      }
    return result;
  }
  Matrix inverse() const {
    Matrix result;
    const auto minor = [&](unsigned r, unsigned c) {
      const unsigned r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
      return m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
    };
    const double determinant = m[0][0] * minor(0, 0) + m[0][1] * minor(0, 1) + m[0][2] * minor(0, 2);
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) result.m[r][c] = minor(c, r) / determinant;
    for (unsigned r = 0; r < 3; ++r)
      result.m[r][3] = -(result.m[r][0] * m[0][3] + result.m[r][1] * m[1][3] + result.m[r][2] * m[2][3]);
    return result;
  }
  Double3 point(const Double3& p) const {
    Double3 result;
    for (unsigned r = 0; r < 3; ++r) result[r] = m[r][0] * p[0] + m[r][1] * p[1] + m[r][2] * p[2] + m[r][3];
    return result;
  }
  /// transpose(matrix) * n: inverse().transposed(n) is a normal from the object to the world.
  Double3 transposed(const Double3& n) const {
    Double3 result;
    for (unsigned c = 0; c < 3; ++c) result[c] = m[0][c] * n[0] + m[1][c] * n[1] + m[2][c] * n[2];
    return result;
  }
};

void check_close(const hiprtFloat3& a, const Double3& b, double scale = 1.0) {
  const double size = std::abs(b[0]) + std::abs(b[1]) + std::abs(b[2]) + scale;
  CHECK(std::abs(a.x - b[0]) <= 1e-5 * size);
  CHECK(std::abs(a.y - b[1]) <= 1e-5 * size);
  CHECK(std::abs(a.z - b[2]) <= 1e-5 * size);
}

/// All queries of an instance (or of a path), at a time.
template <class Id>
void check_queries(hiprtScene scene, const Id& id, float time, const Matrix& to_world, Random& random) {
  const auto p = random.in_cube(2.0);
  const hiprtFloat3 v{p[0], p[1], p[2]};
  const Double3 exact{p[0], p[1], p[2]};
  const Matrix to_object = to_world.inverse();
  check_close(hiprtPointObjectToWorld(v, scene, id, time), to_world.point(exact));
  check_close(hiprtPointWorldToObject(v, scene, id, time), to_object.point(exact), 20);
  check_close(hiprtVectorObjectToWorld(v, scene, id, time), to_object.transposed(exact), 20);
  check_close(hiprtVectorWorldToObject(v, scene, id, time), to_world.transposed(exact));
  const hiprtFrameMatrix world = hiprtGetObjectToWorldFrameMatrix(scene, id, time),
                         object = hiprtGetWorldToObjectFrameMatrix(scene, id, time);
  CHECK(world.time == time);
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 4; ++c) {
      CHECK(std::abs(world.matrix[r][c] - to_world.m[r][c]) <= 2e-5);
      CHECK(std::abs(object.matrix[r][c] - to_object.m[r][c]) <= 2e-4);
    }
}

/// Rotation (axis and angle) of the scaled point, and translation.
Double3 apply(const hiprtFrameSRT& frame, const Double3& p) {
  const double c = std::cos(double{frame.rotation.w}), s = std::sin(double{frame.rotation.w});
  const Double3 axis{frame.rotation.x, frame.rotation.y, frame.rotation.z},
      scaled{p[0] * frame.scale.x, p[1] * frame.scale.y, p[2] * frame.scale.z},
      moved{frame.translation.x, frame.translation.y, frame.translation.z};
  const double along = axis[0] * scaled[0] + axis[1] * scaled[1] + axis[2] * scaled[2];
  Double3 result;
  for (unsigned k = 0; k < 3; ++k) {
    const unsigned a = (k + 1) % 3, b = (k + 2) % 3;
    result[k] = scaled[k] * c + (axis[a] * scaled[b] - axis[b] * scaled[a]) * s + axis[k] * along * (1 - c) + moved[k];
  }
  return result;
}

}  // namespace

TEST_CASE("transform queries of one level and of a path, still and moving") {
  INFO("seed " << kSeed);
  Random random(kSeed + 30);
  const Triangles object(Corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  for (unsigned round = 0; round < 30; ++round) {
    CAPTURE(round);
    const auto inner = checks::random_affine(random, 2.0), outer = checks::random_affine(random, 2.0);
    auto later = inner;
    for (auto& row : later.row) row[3] += 1.0f;
    build::Motion motion{.kind = MotionKind::kMatrix, .matrices = {{0.0f, inner}, {1.0f, later}}};
    Forest flat, nested;
    flat.add_file(object.bvh);
    nested.add_file(object.bvh);
    for (Forest* forest : {&flat, &nested}) {
      forest->add_instance({.object = 0, .to_scene = outer});
      forest->add_instance({.object = 0, .motion = &motion});
    }
    nested.next_level();
    nested.add_instance({.object = 0});
    nested.add_instance({.object = 1, .to_scene = outer});
    flat.build();
    nested.build();
    const SceneView flat_view = flat.view(), nested_view = nested.view();
    const float time = random.uniform_float(-0.5, 1.5);
    const double part = std::clamp(double{time}, 0.0, 1.0);
    Matrix moving(inner);
    for (auto& row : moving.m) row[3] += part;
    check_queries(scene_handle(&flat_view), 0u, time, Matrix(outer), random);
    check_queries(scene_handle(&flat_view), 1u, time, moving, random);
    constexpr std::uint32_t kNone = hiprtInvalidValue;
    const std::uint32_t single[4] = {1, kNone, kNone, kNone}, direct[4] = {0, kNone, kNone, kNone},
                        path[4] = {1, 1, kNone, kNone}, other[4] = {1, 0, kNone, kNone};
    check_queries(scene_handle(&flat_view), single, time, moving, random);
    check_queries(scene_handle(&nested_view), direct, time, Matrix(), random);
    check_queries(scene_handle(&nested_view), path, time, Matrix(outer) * moving, random);
    check_queries(scene_handle(&nested_view), other, time, Matrix(outer) * Matrix(outer), random);
    check_queries(scene_handle(&nested_view), 1u, time, Matrix(outer), random);
  }
}

TEST_CASE("trap: vector queries transform normals") {
  const Triangles object(Corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  Forest forest;
  forest.add_file(object.bvh);
  forest.add_instance({.object = 0, .to_scene = {{{2, 0, 0, 5}, {0, 1, 0, 6}, {0, 0, 1, 7}}}});
  forest.build();
  const SceneView view = forest.view();
  const hiprtScene scene = scene_handle(&view);
  CHECK(hiprtVectorObjectToWorld({1, 1, 0}, scene, 0u) == hiprtFloat3{0.5f, 1, 0});
  CHECK(hiprtVectorWorldToObject({0.5f, 1, 0}, scene, 0u) == hiprtFloat3{1, 1, 0});
  CHECK(hiprtPointObjectToWorld({1, 1, 0}, scene, 0u) == hiprtFloat3{7, 7, 7});
  CHECK(hiprtPointWorldToObject({7, 7, 7}, scene, 0u) == hiprtFloat3{1, 1, 0});
}

TEST_CASE("trap: rays and points of moving, sheared instances") {
  // In HIPRT the way there and back of this point ends elsewhere.
  const Triangles object(Corners{{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}});
  const build::Affine sheared{{{1, 0.5f, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
  auto later = sheared;
  later.row[2][3] = 2.0f;
  build::Motion motion{.matrices = {{0.0f, sheared}, {1.0f, later}}};
  Forest forest;
  forest.add_file(object.bvh);
  forest.add_instance({.object = 0, .motion = &motion});
  forest.build();
  const SceneView view = forest.view();
  const hiprtScene scene = scene_handle(&view);
  for (const float time : {0.0f, 0.5f, 1.0f}) {
    const hiprtFloat3 p{0.3f, 0.7f, -0.2f};
    const hiprtFloat3 there = hiprtPointObjectToWorld(p, scene, 0u, time);
    check_close(there, {0.3 + 0.5 * 0.7, 0.7, -0.2 + 2.0 * time});
    check_close(hiprtPointWorldToObject(there, scene, 0u, time), {0.3, 0.7, -0.2});
    // (0.6, 0.4) is outside of the triangle, its image (0.8, 0.4) is that of a point outside; (0.3, 0.4) is inside.
    const auto hits = [&](float x, float y) {
      const hiprtRay ray = make_ray({x + 0.5f * y, y, -5}, {0, 0, 1});
      return hiprtSceneTraversalClosest(scene, ray, hiprtFullRayMask, hiprtTraversalHintDefault, nullptr, nullptr, 0,
                                        time)
          .getNextHit();
    };
    CHECK(hits(0.2f, 0.4f).t == Approx(5.0f + 2.0f * time));
    CHECK(is_miss(hits(0.6f, 0.4f)));
  }
}

TEST_CASE("trap: frames of scale, rotation and translation have an axis and an angle") {
  INFO("seed " << kSeed);
  Random random(kSeed + 31);
  const Triangles object(Corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  for (unsigned round = 0; round < 200; ++round) {
    CAPTURE(round);
    const double angle = round < 8 ? round * std::numbers::pi / 4 : random.uniform(0, 6.3);
    const oracle::Double3 axis = round < 8 ? oracle::Double3{0, 0, 1} : random.on_sphere();
    const double mirror = random.coin() ? -1.0 : 1.0;
    const auto affine = checks::affine(
        axis, angle, {mirror * random.log_uniform(0.3, 3), random.log_uniform(0.3, 3), random.log_uniform(0.3, 3)},
        {1, 2, 3});
    Forest forest;
    forest.add_file(object.bvh);
    forest.add_instance({.object = 0, .to_scene = affine});
    forest.build();
    const SceneView view = forest.view();
    const hiprtFrameSRT frame = hiprtGetObjectToWorldFrameSRT(scene_handle(&view), 0u, 0.5f);
    CHECK(frame.time == 0.5f);
    const hiprtFloat4& r = frame.rotation;
    CHECK(r.x * r.x + r.y * r.y + r.z * r.z == Approx(1.0f));
    for (const Double3& p : {Double3{1, 0, 0}, Double3{0, 1, 0}, Double3{0, 0, 1}, Double3{1, 2, 3}}) {
      const Double3 expected = Matrix(affine).point(p), got = apply(frame, p);
      for (unsigned k = 0; k < 3; ++k) CHECK(std::abs(got[k] - expected[k]) < 2e-5);
    }
  }
}

TEST_CASE("the frame from the world to the object of a rotation is its inverse") {
  const Triangles object(Corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  Forest forest;
  forest.add_file(object.bvh);
  forest.add_instance({.object = 0, .to_scene = {{{0, -2, 0, 1}, {2, 0, 0, 2}, {0, 0, 2, 3}}}});
  forest.build();
  const SceneView view = forest.view();
  const hiprtFrameSRT frame = hiprtGetWorldToObjectFrameSRT(scene_handle(&view), 0u, 0.0f);
  const Double3 back = apply(frame, {1 - 2 * 0.5, 2 + 2 * 0.25, 3 + 2 * 0.75});
  CHECK(back[0] == Approx(0.25));
  CHECK(back[1] == Approx(0.5));
  CHECK(back[2] == Approx(0.75));
}
