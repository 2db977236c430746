// Each call of the GPU runtime that fails, in every function of the library that makes calls: an error, no memory lost,
// and the next call of the function works.

#include <tests/hiprt_api/program.h>
#include <tests/hiprt_api/runtime_faults.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>

using namespace hiprt_api_test;

namespace {

/// What an operation has made so far.
struct Made {
  std::vector<hiprtGeometry> geometries;
  std::vector<hiprtScene> scenes;
  hiprtFuncTable table = nullptr;
  hiprtGlobalStackBuffer stacks{};

  void destroy(hiprtContext context) {
    for (const hiprtScene scene : scenes)
      if (scene != nullptr) HIPRT_OK(hiprtDestroyScene(context, scene));
    for (const hiprtGeometry geometry : geometries)
      if (geometry != nullptr) HIPRT_OK(hiprtDestroyGeometry(context, geometry));
    if (table != nullptr) HIPRT_OK(hiprtDestroyFuncTable(context, table));
    if (stacks.stackData != nullptr) HIPRT_OK(hiprtDestroyGlobalStackBuffer(context, stacks));
    *this = {};
  }
};

/// Makes calls up to the first error, which it returns.
using Operation = std::function<hiprtError(Made& made)>;

void check_every_call(Program& program, const char* name, const Operation& operation) {
  CAPTURE(name);
  Made made;
  // The first runs fill the library's pools.
  for (int i = 0; i < 2; ++i) {
    HIPRT_OK(operation(made));
    made.destroy(program.context);
  }
  const Held before = held();
  fail_call(0);
  HIPRT_OK(operation(made));
  const unsigned count = calls_that_may_fail();
  made.destroy(program.context);
  REQUIRE(count > 0);
  REQUIRE(held() == before);
  unsigned errors = 0;
  for (unsigned number = 1; number <= count; ++number) {
    CAPTURE(number, count);
    fail_call(number);
    const hiprtError error = operation(made);
    calls_that_may_fail();
    if (error != hiprtSuccess) {
      ++errors;
      CHECK(
          (error == hiprtErrorOutOfDeviceMemory || error == hiprtErrorOutOfHostMemory || error == hiprtErrorInternal));
    }
    made.destroy(program.context);
    CHECK(held().device == before.device);
    // The library keeps host memory, and an event of it, for the next build.
    CHECK(held().events <= before.events);
    if (number % 10 == 1) {
      CHECK(operation(made) == hiprtSuccess);
      made.destroy(program.context);
      CHECK(held().device == before.device);
    }
  }
  CHECK(held().host <= before.host);
  std::printf("%s: %u calls failed in turn, %u errors, %u survived\n", name, count, errors, count - errors);
}

/// Stops at the first error.
#define HIPRT_STEP(call) \
  if (const hiprtError error = (call); error != hiprtSuccess) return error

struct Quiet : Program {
  Quiet() { HIPRT_OK(hiprtSetLogLevel(context, hiprtLogLevelNone)); }
};

hiprtError build(Program& program, const hiprtGeometryBuildInput& input, hiprtBuildFlags flags, Made& made) {
  const hiprtBuildOptions options{flags, 0};
  made.geometries.push_back(nullptr);
  HIPRT_STEP(hiprtCreateGeometry(program.context, input, options, made.geometries.back()));
  // Without a temporary buffer the library allocates one.
  return hiprtBuildGeometry(program.context, hiprtBuildOperationBuild, input, options, nullptr, nullptr,
                            made.geometries.back());
}

}  // namespace

TEST_CASE("faults: geometries") {
  Quiet program;
  const hiprtGeometryBuildInput input = Mesh::soup(60, 1).upload(program);
  const std::pair<const char*, hiprtBuildFlags> builds[] = {
      {"fast build", hiprtBuildFlagBitPreferFastBuild},
      {"balanced build", hiprtBuildFlagBitPreferBalancedBuild},
      {"high quality build", hiprtBuildFlagBitPreferHighQualityBuild}};
  for (const auto& [name, flags] : builds)
    check_every_call(program, name, [&, flag = flags](Made& made) { return build(program, input, flag, made); });
}

TEST_CASE("faults: updates and compaction of geometries") {
  Quiet program;
  const hiprtGeometryBuildInput input = Mesh::soup(60, 1).upload(program);
  check_every_call(program, "update", [&](Made& made) {
    HIPRT_STEP(build(program, input, hiprtBuildFlagBitPreferFastBuild, made));
    return hiprtBuildGeometry(program.context, hiprtBuildOperationUpdate, input, {hiprtBuildFlagBitPreferFastBuild, 0},
                              nullptr, nullptr, made.geometries[0]);
  });
  check_every_call(program, "compaction", [&](Made& made) {
    HIPRT_STEP(build(program, input, hiprtBuildFlagBitPreferFastBuild, made));
    return hiprtCompactGeometry(program.context, nullptr, made.geometries[0], made.geometries[0]);
  });
}

TEST_CASE("faults: batches of geometries") {
  Quiet program;
  const std::vector<hiprtGeometryBuildInput> inputs{Mesh::soup(20, 1).upload(program),
                                                    Mesh::soup(30, 2).upload(program)};
  const hiprtBuildOptions options{hiprtBuildFlagBitPreferFastBuild, 64};
  check_every_call(program, "batch", [&](Made& made) {
    made.geometries.assign(inputs.size(), nullptr);
    std::vector<hiprtGeometry*> addresses;
    for (hiprtGeometry& geometry : made.geometries) addresses.push_back(&geometry);
    const auto count = static_cast<uint32_t>(inputs.size());
    HIPRT_STEP(hiprtCreateGeometries(program.context, count, inputs.data(), options, addresses.data()));
    return hiprtBuildGeometries(program.context, hiprtBuildOperationBuild, count, inputs.data(), options, nullptr,
                                nullptr, made.geometries.data());
  });
}

TEST_CASE("faults: scenes") {
  Quiet program;
  const hiprtGeometry geometry = program.build(Mesh::soup(40, 1).upload(program));
  SceneArraysOnHost arrays, moving;
  for (int i = 0; i < 3; ++i) arrays.add(geometry);
  moving.add(geometry);
  moving.move({1, 0, 0}, 0.0f);
  moving.move({2, 0, 0}, 1.0f);
  hiprtTransformHeader header{};
  header.frameIndex = 0;
  header.frameCount = 2;
  moving.headers.push_back(header);
  const hiprtSceneBuildInput still = arrays.upload(program), moved = moving.upload(program);
  const hiprtBuildOptions options{hiprtBuildFlagBitPreferFastBuild, 0};
  const auto build_scene = [&](const hiprtSceneBuildInput& input, Made& made) -> hiprtError {
    made.scenes.push_back(nullptr);
    HIPRT_STEP(hiprtCreateScene(program.context, input, options, made.scenes.back()));
    return hiprtBuildScene(program.context, hiprtBuildOperationBuild, input, options, nullptr, nullptr,
                           made.scenes.back());
  };
  check_every_call(program, "scene", [&](Made& made) { return build_scene(still, made); });
  check_every_call(program, "scene that moves", [&](Made& made) { return build_scene(moved, made); });
  check_every_call(program, "update of a scene", [&](Made& made) {
    HIPRT_STEP(build_scene(still, made));
    return hiprtBuildScene(program.context, hiprtBuildOperationUpdate, still, options, nullptr, nullptr,
                           made.scenes[0]);
  });
  check_every_call(program, "compaction of a scene", [&](Made& made) {
    HIPRT_STEP(build_scene(still, made));
    return hiprtCompactScene(program.context, nullptr, made.scenes[0], made.scenes[0]);
  });
  HIPRT_OK(hiprtDestroyGeometry(program.context, geometry));
}

TEST_CASE("faults: tables, stacks and files") {
  Quiet program;
  const hiprtGeometry geometry = program.build(Mesh::soup(40, 1).upload(program));
  check_every_call(program, "function table", [&](Made& made) {
    HIPRT_STEP(hiprtCreateFuncTable(program.context, 2, 2, made.table));
    return hiprtSetFuncTable(program.context, made.table, 1, 1, {});
  });
  check_every_call(program, "stack buffer", [&](Made& made) {
    return hiprtCreateGlobalStackBuffer(program.context, {hiprtStackTypeGlobal, hiprtStackEntryTypeInteger, 64, 4096},
                                        made.stacks);
  });
  const std::string path =
      (std::filesystem::temp_directory_path() / ("hiprt_api_faults_" + std::to_string(std::random_device()()) + ".bvh"))
          .string();
  const auto bytes = [&] {
    std::ifstream file(path, std::ios::binary);
    return std::vector<char>(std::istreambuf_iterator<char>(file), {});
  };
  HIPRT_OK(hiprtSaveGeometry(program.context, geometry, path.c_str()));
  const std::vector<char> whole = bytes();
  REQUIRE(whole.size() > 1000);
  check_every_call(program, "save", [&](Made&) {
    const hiprtError error = hiprtSaveGeometry(program.context, geometry, path.c_str());
    CHECK(bytes().size() == whole.size());  // The old file or the new one.
    return error;
  });
  check_every_call(program, "load", [&](Made& made) {
    made.geometries.push_back(nullptr);
    return hiprtLoadGeometry(program.context, made.geometries.back(), path.c_str());
  });
  std::filesystem::remove(path);
  HIPRT_OK(hiprtDestroyGeometry(program.context, geometry));
}
