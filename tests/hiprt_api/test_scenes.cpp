// Scenes: frames, masks, motion, updates, scenes of scenes, files.

#include <tests/hiprt_api/program.h>

#include <filesystem>

using namespace hiprt_api_test;

namespace {

constexpr float kPi = 3.14159265f;

std::vector<float> world_points(Program& program) {
  auto* const positions = static_cast<float*>(program.take(3 * program.last.count * sizeof(float)));
  HIP_OK(to_world(program.last, positions));
  return program.read(positions, 3 * program.last.count);
}

hiprtFrameMatrix matrix_at(float x, float y, float z, float scale = 1.0f, float time = 0.0f) {
  return {{{scale, 0, 0, x}, {0, scale, 0, y}, {0, 0, scale, z}}, time};
}

}  // namespace

TEST_CASE("instances with frames and masks") {
  Program program;
  const hiprtGeometry triangle = program.build(Mesh::triangle().upload(program));
  for (const hiprtBuildFlags flags : {0u, 1u, 2u}) {
    CAPTURE(flags);
    SceneArraysOnHost arrays;
    for (unsigned i = 0; i < 4; ++i) arrays.add(triangle);
    arrays.move({0, 0, 0});
    arrays.move({2, 0, 1});
    // A quarter turn around z: the triangle lies at x <= 4, y >= 0.
    arrays.move({4, 0, 2}).rotation = {0, 0, 3, kPi / 2};
    arrays.move({6, 0, 3}).scale = {2, 2, 1};
    arrays.masks = {1, 2, 1, 3};
    const hiprtScene scene = program.build(arrays.upload(program), flags);
    const std::vector<hiprtRay> rays{ray_at(0.2f, 0.2f), ray_at(2.2f, 0.2f), ray_at(3.8f, 0.2f), ray_at(7.2f, 0.2f),
                                     ray_at(4.2f, 0.2f)};
    auto hits = program.trace(trace_scene, scene, rays);
    for (unsigned i = 0; i < 4; ++i) {
      CAPTURE(i);
      CHECK(hits[i].instanceID == i);
      CHECK(hits[i].t == Approx(10.0 - i));
    }
    CHECK_FALSE(hits[4].hasHit());
    const auto points = world_points(program);
    CHECK(points[6] == Approx(4.0 - 0.7));
    CHECK(points[7] == Approx(0.3));
    CHECK(points[9] == Approx(6.6));
    hits = program.trace(trace_scene, scene, rays, nullptr, 2);
    CHECK((!hits[0].hasHit() && hits[1].hasHit() && !hits[2].hasHit() && hits[3].hasHit()));
    hiprtFloat3 low, high;
    HIPRT_OK(hiprtExportSceneAabb(program.context, scene, low, high));
    CHECK(low.x <= 0.0f);
    CHECK(high.x >= 8.0f);
    CHECK(high.z >= 3.0f);
    HIPRT_OK(hiprtDestroyScene(program.context, scene));
  }
}

TEST_CASE("identity frames, matrices, and a matrix without an inverse") {
  Program program;
  const hiprtGeometry triangle = program.build(Mesh::triangle().upload(program));
  SceneArraysOnHost plain;
  plain.add(triangle);
  auto hits = program.trace(trace_scene, program.build(plain.upload(program)), {ray_at(0.2f, 0.2f)});
  CHECK(hits[0].t == Approx(10.0));
  SceneArraysOnHost arrays;
  for (unsigned i = 0; i < 3; ++i) arrays.add(triangle);
  arrays.matrices = {matrix_at(0, 0, 1), matrix_at(2, 0, 0, 0.0f), matrix_at(4, 0, 2, 2.0f)};
  hits = program.trace(trace_scene, program.build(arrays.upload(program)),
                       {ray_at(0.2f, 0.2f), ray_at(2.2f, 0.2f), ray_at(5.2f, 0.2f)});
  CHECK(hits[0].t == Approx(9.0));
  CHECK_FALSE(hits[1].hasHit());
  CHECK((hits[2].instanceID == 2 && hits[2].t == Approx(8.0)));
}

TEST_CASE("motion between frames of both kinds") {
  Program program;
  const hiprtGeometry triangle = program.build(Mesh::triangle().upload(program));
  for (const bool matrices : {false, true}) {
    CAPTURE(matrices);
    SceneArraysOnHost arrays;
    arrays.add(triangle);
    arrays.add(triangle);
    arrays.headers = {{0, 1}, {1, 2}};
    if (matrices) {
      arrays.matrices = {matrix_at(0, 0, 0), matrix_at(2, 0, 0), matrix_at(4, 0, 2, 1.0f, 1.0f)};
    } else {
      arrays.move({0, 0, 0});
      arrays.move({2, 0, 0});
      arrays.move({4, 0, 2}, 1.0f);
    }
    const hiprtScene scene = program.build(arrays.upload(program));
    const std::vector<hiprtRay> rays{ray_at(0.2f, 0.2f), ray_at(2.2f, 0.2f), ray_at(3.2f, 0.2f), ray_at(4.2f, 0.2f)};
    for (const float time : {0.0f, 0.5f, 1.0f}) {
      CAPTURE(time);
      const auto hits = program.trace(trace_scene, scene, rays, nullptr, hiprtFullRayMask, time);
      const auto at = static_cast<unsigned>(2.0f * time);
      CHECK(hits[0].t == Approx(10.0));
      for (unsigned i = 0; i < 3; ++i) {
        CAPTURE(i);
        CHECK(hits[1 + i].hasHit() == (i == at));
        if (i == at) CHECK(hits[1 + i].t == Approx(10.0f - 2.0f * time));
      }
      CHECK(world_points(program)[3 * (1 + at)] == Approx(2.3f + 2.0f * time));
    }
  }
}

TEST_CASE("updates of a scene, and a second build") {
  Program program;
  const hiprtGeometry triangle = program.build(Mesh::triangle().upload(program));
  SceneArraysOnHost arrays;
  arrays.add(triangle);
  arrays.move({0, 0, 0});
  const hiprtScene scene = program.build(arrays.upload(program));
  arrays.turns[0].translation = {5, 0, 4};
  program.rebuild(arrays.upload(program), 0, scene, hiprtBuildOperationUpdate);
  const auto hits = program.trace(trace_scene, scene, {ray_at(0.2f, 0.2f), ray_at(5.2f, 0.2f)});
  CHECK_FALSE(hits[0].hasHit());
  CHECK(hits[1].t == Approx(6.0));
}

TEST_CASE("scenes of scenes") {
  Program program;
  const hiprtGeometry low = program.build(Mesh::triangle().upload(program)),
                      high = program.build(Mesh::triangle(0.5f).upload(program));
  SceneArraysOnHost inner;
  inner.add(low);
  inner.add(high);
  inner.move({0, 0, 0});
  inner.move({2, 0, 0});
  const hiprtScene pair = program.build(inner.upload(program));
  SceneArraysOnHost middle;
  middle.add_scene(pair);
  middle.add(low);
  middle.add_scene(pair);
  middle.move({0, 0, 0});
  middle.move({4, 0, 1});
  middle.move({6, 0, 2});
  const hiprtScene three = program.build(middle.upload(program));
  SceneArraysOnHost outer;
  outer.add(high);
  outer.add_scene(three);
  outer.add_scene(pair);
  outer.move({-2, 0, 0});
  outer.move({0, 0, 3});
  outer.move({12, 0, 0});
  const hiprtScene whole = program.build(outer.upload(program));

  struct Expected {
    float x, t;
    uint32_t path[3];
  };
  constexpr uint32_t kNo = hiprtInvalidValue;
  const Expected in_middle[] = {{0.2f, 10.0f, {0, 0, kNo}},
                                {2.2f, 9.5f, {0, 1, kNo}},
                                {4.2f, 9.0f, {1, kNo, kNo}},
                                {6.2f, 8.0f, {2, 0, kNo}},
                                {8.2f, 7.5f, {2, 1, kNo}}};
  const Expected in_whole[] = {{-1.8f, 9.5f, {0, kNo, kNo}}, {0.2f, 7.0f, {1, 0, 0}},   {2.2f, 6.5f, {1, 0, 1}},
                               {4.2f, 6.0f, {1, 1, kNo}},    {6.2f, 5.0f, {1, 2, 0}},   {8.2f, 4.5f, {1, 2, 1}},
                               {12.2f, 10.0f, {2, 0, kNo}},  {14.2f, 9.5f, {2, 1, kNo}}};
  const auto check = [&](hiprtScene scene, const auto& expected) {
    std::vector<hiprtRay> rays;
    for (const Expected& one : expected) rays.push_back(ray_at(one.x, 0.2f));
    const auto hits = program.trace(trace_scene, scene, rays);
    const auto points = world_points(program);
    for (size_t i = 0; i < rays.size(); ++i) {
      CAPTURE(i);
      CHECK(hits[i].t == Approx(expected[i].t));
      for (unsigned level = 0; level < 3; ++level) CHECK(hits[i].instanceIDs[level] == expected[i].path[level]);
      CHECK(points[3 * i] == Approx(expected[i].x - 0.2f + 0.3f));
    }
  };
  check(three, in_middle);
  check(whole, in_whole);
  // Files keep the scenes inside. Loaded ones may be inside of another scene.
  const std::string path = (std::filesystem::temp_directory_path() / "hiprt_api_nested.bvh").string();
  hiprtScene loaded = nullptr;
  HIPRT_OK(hiprtSaveScene(program.context, whole, path.c_str()));
  HIPRT_OK(hiprtLoadScene(program.context, loaded, path.c_str()));
  check(loaded, in_whole);
  HIPRT_OK(hiprtSaveScene(program.context, three, path.c_str()));
  HIPRT_OK(hiprtLoadScene(program.context, loaded, path.c_str()));
  std::filesystem::remove(path);
  outer.instances[1].scene = loaded;
  check(program.build(outer.upload(program)), in_whole);
  // Records were copied: the inner scenes' handles stay theirs.
  const auto hits = program.trace(trace_scene, pair, {ray_at(2.2f, 0.2f)});
  CHECK((hits[0].instanceIDs[0] == 1 && hits[0].instanceIDs[1] == kNo));
}

TEST_CASE("scenes: compaction, files, destruction in any order") {
  Program program;
  const hiprtGeometry triangle = program.build(Mesh::triangle().upload(program));
  SceneArraysOnHost arrays;
  arrays.add(triangle);
  arrays.add(triangle);
  arrays.move({0, 0, 0});
  arrays.move({3, 0, 1});
  hiprtScene scene = program.build(arrays.upload(program));
  HIPRT_OK(hiprtCompactScene(program.context, nullptr, scene, scene));
  const std::string path = (std::filesystem::temp_directory_path() / "hiprt_api_scene.bvh").string();
  HIPRT_OK(hiprtSaveScene(program.context, scene, path.c_str()));
  HIPRT_OK(hiprtDestroyGeometry(program.context, triangle));
  HIPRT_OK(hiprtDestroyScene(program.context, scene));
  hiprtScene loaded = nullptr;
  HIPRT_OK(hiprtLoadScene(program.context, loaded, path.c_str()));
  const auto hits = program.trace(trace_scene, loaded, {ray_at(0.2f, 0.2f), ray_at(3.2f, 0.2f)});
  CHECK(hits[0].t == Approx(10.0));
  CHECK((hits[1].t == Approx(9.0) && hits[1].instanceID == 1));
  HIPRT_OK(hiprtDestroyScene(program.context, loaded));
  std::filesystem::remove(path);
}
