// Geometries: builders, input forms, custom primitives, updates, imports, compaction, files, threads.

#include <tests/hiprt_api/program.h>

#include <filesystem>
#include <thread>

using namespace hiprt_api_test;

TEST_CASE("geometries of all builders have the hits of a loop over the triangles") {
  Program program;
  const Mesh mesh = Mesh::soup(60, 1);
  const auto rays = rays_over_cube(128, 2);
  const auto input = mesh.upload(program);
  for (const hiprtBuildFlags flags :
       {hiprtBuildFlagBitPreferFastBuild, hiprtBuildFlagBitPreferBalancedBuild, hiprtBuildFlagBitPreferHighQualityBuild,
        hiprtBuildFlagBits(hiprtBuildFlagBitPreferHighQualityBuild | hiprtBuildFlagBitDisableSpatialSplits)}) {
    CAPTURE(flags);
    const hiprtGeometry geometry = program.build(input, flags);
    check_hits(mesh, rays, program.trace(trace_geometry, geometry, rays));
    HIPRT_OK(hiprtDestroyGeometry(program.context, geometry));
  }
}

TEST_CASE("strides, and triangles without indices") {
  Program program;
  const Mesh mesh = Mesh::soup(20, 3);
  const auto rays = rays_over_cube(64, 4);
  auto input = mesh.upload(program, 32);
  check_hits(mesh, rays, program.trace(trace_geometry, program.build(input), rays));
  input.primitive.triangleMesh.triangleIndices = nullptr;
  input.primitive.triangleMesh.triangleCount = 0;
  check_hits(mesh, rays, program.trace(trace_geometry, program.build(input), rays));
}

TEST_CASE("boxes of 24 and 32 bytes, function tables and exported boxes") {
  Program program;
  const std::vector<float> narrow{0, 0, 0, 1, 1, 1, 2, 0, 0, 3, 1, 5},
      wide{0, 0, 0, 9, 1, 1, 1, 9, 2, 0, 0, 9, 3, 1, 5, 9};
  const auto* const ts = program.copy(std::vector<float>{4.0f, 3.0f});
  const auto* const rejected = program.copy(std::vector<uint32_t>{1u});
  for (const auto& boxes : {narrow, wide}) {
    hiprtGeometryBuildInput input;
    input.type = hiprtPrimitiveTypeAABBList;
    input.geomType = 2;
    input.primitive.aabbList = {program.copy(boxes), 2, static_cast<uint32_t>(boxes.size() * sizeof(float) / 2)};
    const hiprtGeometry geometry = program.build(input);
    hiprtFloat3 low, high;
    HIPRT_OK(hiprtExportGeometryAabb(program.context, geometry, low, high));
    CHECK((low.x == 0 && low.y == 0 && low.z == 0 && high.x == 3 && high.y == 1 && high.z == 5));
    hiprtFuncTable table = nullptr;
    HIPRT_OK(hiprtCreateFuncTable(program.context, 3, 1, table));
    HIPRT_OK(hiprtSetFuncTable(program.context, table, 2, 0, {ts, nullptr}));
    CHECK(hiprtSetFuncTable(program.context, table, 3, 0, {ts, nullptr}) == hiprtErrorInvalidParameter);
    const std::vector<hiprtRay> rays{ray_at(0.5f, 0.5f), ray_at(2.5f, 0.5f), ray_at(1.5f, 0.5f)};
    auto hits = program.trace(trace_geometry, geometry, rays, table);
    CHECK((hits[0].primID == 0 && hits[0].t == 4.0f));
    CHECK((hits[1].primID == 1 && hits[1].t == 3.0f));
    CHECK((!hits[2].hasHit() && hits[2].t == -1.0f));
    HIPRT_OK(hiprtSetFuncTable(program.context, table, 2, 0, {ts, rejected}));
    hits = program.trace(trace_geometry, geometry, rays, table);
    CHECK(hits[0].hasHit());
    CHECK_FALSE(hits[1].hasHit());
    HIPRT_OK(hiprtDestroyFuncTable(program.context, table));
    HIPRT_OK(hiprtDestroyGeometry(program.context, geometry));
  }
}

TEST_CASE("updates and second builds show the new vertices") {
  Program program;
  for (const hiprtBuildFlags flags : {hiprtBuildFlagBitPreferFastBuild, hiprtBuildFlagBitPreferHighQualityBuild}) {
    const Mesh first = Mesh::soup(40, 5);
    const hiprtGeometry geometry = program.build(first.upload(program), flags);
    const auto rays = rays_over_cube(64, 7);
    for (const uint32_t seed : {6u, 8u}) {
      const Mesh moved = Mesh::soup(40, seed);
      program.rebuild(moved.upload(program), flags, geometry, hiprtBuildOperationUpdate);
      check_hits(moved, rays, program.trace(trace_geometry, geometry, rays));
    }
    program.rebuild(first.upload(program), flags, geometry, hiprtBuildOperationBuild);
    check_hits(first, rays, program.trace(trace_geometry, geometry, rays));
  }
}

TEST_CASE("an imported tree") {
  Program program;
  const Mesh mesh = Mesh::soup(4, 11);
  std::vector<hiprtInternalNode> nodes(3);
  std::vector<hiprtLeafNode> leaves(4);
  const auto child = [&](unsigned node, unsigned slot, uint32_t index, bool leaf) {
    nodes[node].childIndices[slot] = index;
    nodes[node].childNodeTypes[slot] = leaf ? hiprtBvhNodeTypeLeaf : hiprtBvhNodeTypeInternal;
  };
  child(0, 0, 2, false);
  child(0, 1, 1, false);
  child(1, 0, 0, true);
  child(1, 1, 3, true);
  child(2, 0, 1, true);
  child(2, 1, 2, true);
  for (uint32_t i = 0; i < 4; ++i) leaves[i].primID = i;
  auto input = mesh.upload(program);
  input.nodeList = {program.copy(nodes), program.copy(leaves), 4};
  const auto rays = rays_over_cube(256, 12);
  const hiprtGeometry geometry = program.build(input, hiprtBuildFlagBitCustomBvhImport);
  check_hits(mesh, rays, program.trace(trace_geometry, geometry, rays));
}

TEST_CASE("compaction in place, and files") {
  Program program;
  const Mesh mesh = Mesh::soup(50, 13);
  const auto rays = rays_over_cube(64, 14);
  hiprtGeometry geometry = program.build(mesh.upload(program), hiprtBuildFlagBitPreferHighQualityBuild);
  HIPRT_OK(hiprtCompactGeometry(program.context, nullptr, geometry, geometry));
  check_hits(mesh, rays, program.trace(trace_geometry, geometry, rays));
  const std::string path = (std::filesystem::temp_directory_path() / "hiprt_api_geometry.bvh").string();
  HIPRT_OK(hiprtSaveGeometry(program.context, geometry, path.c_str()));
  HIPRT_OK(hiprtDestroyGeometry(program.context, geometry));
  hiprtGeometry loaded = nullptr;
  HIPRT_OK(hiprtLoadGeometry(program.context, loaded, path.c_str()));
  check_hits(mesh, rays, program.trace(trace_geometry, loaded, rays));
  const Mesh moved = Mesh::soup(50, 15);
  program.rebuild(moved.upload(program), hiprtBuildFlagBitPreferHighQualityBuild, loaded, hiprtBuildOperationUpdate);
  check_hits(moved, rays, program.trace(trace_geometry, loaded, rays));
  HIPRT_OK(hiprtDestroyGeometry(program.context, loaded));
  std::filesystem::remove(path);
  CHECK(hiprtLoadGeometry(program.context, loaded, path.c_str()) == hiprtErrorInternal);
}

TEST_CASE("threads build with one context, each on a stream of its own") {
  Program program;
  constexpr unsigned kThreads = 16;
  std::vector<Mesh> meshes;
  std::vector<hiprtGeometryBuildInput> inputs;
  std::vector<void*> scratch;
  for (unsigned i = 0; i < kThreads; ++i) {
    meshes.push_back(Mesh::soup(30, 30 + i));
    inputs.push_back(meshes.back().upload(program));
    size_t size = 0;
    HIPRT_OK(hiprtGetGeometryBuildTemporaryBufferSize(program.context, inputs.back(), {0, 0}, size));
    scratch.push_back(program.take(size));
  }
  std::vector<hiprtGeometry> geometries(kThreads);
  std::vector<int> done(kThreads, 0);
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < kThreads; ++i)
    threads.emplace_back([&, i] {
      hipStream_t stream = nullptr;
      if (hipStreamCreate(&stream) != hipSuccess) return;
      const bool built = hiprtCreateGeometry(program.context, inputs[i], {0, 0}, geometries[i]) == hiprtSuccess &&
                         hiprtBuildGeometry(program.context, hiprtBuildOperationBuild, inputs[i], {0, 0}, scratch[i],
                                            stream, geometries[i]) == hiprtSuccess;
      done[i] = hipStreamSynchronize(stream) == hipSuccess && built ? 1 : 0;
      static_cast<void>(hipStreamDestroy(stream));
    });
  for (std::thread& thread : threads) thread.join();
  const auto rays = rays_over_cube(64, 16);
  for (unsigned i = 0; i < kThreads; ++i) {
    REQUIRE(done[i] == 1);
    check_hits(meshes[i], rays, program.trace(trace_geometry, geometries[i], rays));
  }
}

TEST_CASE("stack buffers, and missing arguments of a context") {
  Program program;
  hiprtGlobalStackBufferInput input;
  input.stackSize = 16;
  input.threadCount = 256;
  for (const hiprtStackType type : {hiprtStackTypeGlobal, hiprtStackTypeDynamic})
    for (const hiprtStackEntryType entry : {hiprtStackEntryTypeInteger, hiprtStackEntryTypeInstance}) {
      input.type = type;
      input.entryType = entry;
      hiprtGlobalStackBuffer buffer{};
      HIPRT_OK(hiprtCreateGlobalStackBuffer(program.context, input, buffer));
      CHECK((buffer.stackSize == 16 && buffer.stackData != nullptr && buffer.stackCount >= 256));
      HIPRT_OK(hiprtDestroyGlobalStackBuffer(program.context, buffer));
    }
  HIPRT_OK(hiprtDestroyGlobalStackBuffer(program.context, hiprtGlobalStackBuffer{}));
  hiprtGeometry geometry = nullptr;
  CHECK(hiprtCreateGeometry(program.context, hiprtGeometryBuildInput{}, {0, 0}, geometry) ==
        hiprtErrorInvalidParameter);
  // Sizes and creation need no arrays, builds do.
  hiprtGeometryBuildInput counted;
  counted.type = hiprtPrimitiveTypeTriangleMesh;
  counted.primitive.triangleMesh.vertexCount = 30;
  size_t size = 0;
  HIPRT_OK(hiprtGetGeometryBuildTemporaryBufferSize(program.context, counted, {0, 0}, size));
  HIPRT_OK(hiprtCreateGeometry(program.context, counted, {0, 0}, geometry));
  CHECK(hiprtBuildGeometry(program.context, hiprtBuildOperationBuild, counted, {0, 0}, nullptr, nullptr, geometry) ==
        hiprtErrorInvalidParameter);
  HIPRT_OK(hiprtDestroyGeometry(program.context, geometry));
  CHECK(hiprtDestroyGeometry(program.context, nullptr) == hiprtErrorInvalidParameter);
  hiprtFuncTable table = nullptr;
  CHECK(hiprtCreateFuncTable(program.context, 0, 1, table) == hiprtErrorInvalidParameter);
}
