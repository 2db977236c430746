// What is created and destroyed leaves the device's memory as it was.

#include <tests/hiprt_api/program.h>

#include <algorithm>

using namespace hiprt_api_test;

namespace {

size_t free_bytes() {
  size_t free = 0, total = 0;
  HIP_OK(hipDeviceSynchronize());
  HIP_OK(hipMemGetInfo(&free, &total));
  return free;
}

/// Geometries of all kinds, a scene over them and a scene of scenes, destroyed in random order.
void live_and_die(unsigned seed) {
  Program program;
  std::mt19937 random(seed);
  std::vector<hiprtGeometry> geometries;
  std::vector<hiprtScene> scenes;
  const hiprtBuildFlags kinds[] = {hiprtBuildFlagBitPreferFastBuild, hiprtBuildFlagBitPreferBalancedBuild,
                                   hiprtBuildFlagBitPreferHighQualityBuild};
  for (const hiprtBuildFlags flags : kinds)
    geometries.push_back(program.build(Mesh::soup(2000, seed).upload(program), flags));
  HIPRT_OK(hiprtCompactGeometry(program.context, nullptr, geometries[1], geometries[1]));
  program.rebuild(Mesh::soup(2000, seed).upload(program), hiprtBuildFlagBitPreferFastBuild, geometries[0],
                  hiprtBuildOperationUpdate);
  SceneArraysOnHost inner;
  for (const hiprtGeometry geometry : geometries) inner.add(geometry);
  scenes.push_back(program.build(inner.upload(program)));
  SceneArraysOnHost outer;
  outer.add_scene(scenes[0]);
  outer.add(geometries[0]);
  scenes.push_back(program.build(outer.upload(program)));
  hiprtFuncTable table = nullptr;
  HIPRT_OK(hiprtCreateFuncTable(program.context, 2, 2, table));
  hiprtGlobalStackBuffer stacks{};
  HIPRT_OK(hiprtCreateGlobalStackBuffer(program.context, {hiprtStackTypeGlobal, hiprtStackEntryTypeInteger, 64, 4096},
                                        stacks));
  HIP_OK(hipDeviceSynchronize());
  std::shuffle(geometries.begin(), geometries.end(), random);
  std::shuffle(scenes.begin(), scenes.end(), random);
  const bool geometries_first = random() % 2 == 0;
  const auto destroy_geometries = [&] {
    for (const hiprtGeometry geometry : geometries) HIPRT_OK(hiprtDestroyGeometry(program.context, geometry));
  };
  if (geometries_first) destroy_geometries();
  for (const hiprtScene scene : scenes) HIPRT_OK(hiprtDestroyScene(program.context, scene));
  if (!geometries_first) destroy_geometries();
  HIPRT_OK(hiprtDestroyFuncTable(program.context, table));
  HIPRT_OK(hiprtDestroyGlobalStackBuffer(program.context, stacks));
}

}  // namespace

// Hidden: amdrun does not count memory.
TEST_CASE("objects that are destroyed in any order leave no memory allocated", "[.leaks]") {
  live_and_die(1);
  const size_t before = free_bytes();
  for (unsigned seed = 2; seed < 60; ++seed) live_and_die(seed);
  CHECK(free_bytes() == before);
}
