// Geometries that are built together.

#include <tests/hiprt_api/program.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <string>

using namespace hiprt_api_test;

TEST_CASE("a batch of small geometries beside a large one, compacted") {
  Program program;
  std::vector<Mesh> meshes;
  std::vector<hiprtGeometryBuildInput> inputs;
  for (uint32_t i = 0; i < 6; ++i) {
    meshes.push_back(Mesh::soup(i == 2 ? 90 : 25 + i, 20 + i));
    inputs.push_back(meshes.back().upload(program));
  }
  const hiprtBuildOptions options{hiprtBuildFlagBitPreferFastBuild, 64};
  std::vector<hiprtGeometry> geometries(inputs.size());
  std::vector<hiprtGeometry*> addresses;
  for (hiprtGeometry& geometry : geometries) addresses.push_back(&geometry);
  const auto count = static_cast<uint32_t>(inputs.size());
  HIPRT_OK(hiprtCreateGeometries(program.context, count, inputs.data(), options, addresses.data()));
  size_t size = 0;
  HIPRT_OK(hiprtGetGeometriesBuildTemporaryBufferSize(program.context, count, inputs.data(), options, size));
  HIPRT_OK(hiprtBuildGeometries(program.context, hiprtBuildOperationBuild, count, inputs.data(), options,
                                program.take(size), nullptr, geometries.data()));
  const auto rays = rays_over_cube(64, 9);
  const auto check_all = [&] {
    for (uint32_t i = 0; i < count; ++i) {
      CAPTURE(i);
      check_hits(meshes[i], rays, program.trace(trace_geometry, geometries[i], rays));
    }
  };
  check_all();
  const std::string path = (std::filesystem::temp_directory_path() / "hiprt_api_batch.bvh").string();
  const auto check_files = [&] {
    for (const uint32_t i : {0u, 2u, 5u}) {
      CAPTURE(i);
      hiprtGeometry loaded = nullptr;
      HIPRT_OK(hiprtSaveGeometry(program.context, geometries[i], path.c_str()));
      HIPRT_OK(hiprtLoadGeometry(program.context, loaded, path.c_str()));
      check_hits(meshes[i], rays, program.trace(trace_geometry, loaded, rays));
    }
    std::filesystem::remove(path);
  };
  check_files();
  HIPRT_OK(hiprtCompactGeometries(program.context, count, nullptr, geometries.data(), addresses.data()));
  check_all();
  check_files();
  // One of a batch alone.
  HIPRT_OK(hiprtBuildGeometry(program.context, hiprtBuildOperationBuild, inputs[1], options, program.take(1u << 22),
                              nullptr, geometries[1]));
  check_all();
  HIPRT_OK(hiprtDestroyGeometries(program.context, count, geometries.data()));
  CHECK(hiprtDestroyGeometry(program.context, geometries[0]) == hiprtSuccess);  // A warning.
}

TEST_CASE("a million geometries of two triangles, which share their arrays", "[.million]") {
  Program program;
  constexpr uint32_t kCount = 1000000;
  Mesh mesh = Mesh::triangle();
  mesh.points.push_back({1, 1, 1});
  mesh.indices.insert(mesh.indices.end(), {1, 3, 2});
  const std::vector<hiprtGeometryBuildInput> inputs(kCount, mesh.upload(program));
  const hiprtBuildOptions options{hiprtBuildFlagBitPreferFastBuild, 512};
  std::vector<hiprtGeometry> geometries(kCount);
  std::vector<hiprtGeometry*> addresses;
  for (hiprtGeometry& geometry : geometries) addresses.push_back(&geometry);
  const auto begin = std::chrono::steady_clock::now();
  HIPRT_OK(hiprtCreateGeometries(program.context, kCount, inputs.data(), options, addresses.data()));
  size_t size = 0;
  HIPRT_OK(hiprtGetGeometriesBuildTemporaryBufferSize(program.context, kCount, inputs.data(), options, size));
  void* const scratch = program.take(size);
  const auto build = std::chrono::steady_clock::now();
  HIPRT_OK(hiprtBuildGeometries(program.context, hiprtBuildOperationBuild, kCount, inputs.data(), options, scratch,
                                nullptr, geometries.data()));
  HIP_OK(hipDeviceSynchronize());
  const auto end = std::chrono::steady_clock::now();
  std::printf("created in %.3f s, built in %.3f s\n", std::chrono::duration<double>(build - begin).count(),
              std::chrono::duration<double>(end - build).count());
  for (const uint32_t i : {0u, kCount / 2, kCount - 1})
    check_hits(mesh, rays_over_cube(16, i), program.trace(trace_geometry, geometries[i], rays_over_cube(16, i)));
  HIPRT_OK(hiprtCompactGeometries(program.context, kCount, nullptr, geometries.data(), addresses.data()));
  check_hits(mesh, rays_over_cube(16, 3), program.trace(trace_geometry, geometries[kCount - 2], rays_over_cube(16, 3)));
  HIPRT_OK(hiprtDestroyGeometries(program.context, kCount, geometries.data()));
}
