// Kernels that hiprtBuildTraceKernels() compiles.

#include <tests/hiprt_api/program.h>

#if defined(__HIP_PLATFORM_NVIDIA__)
#include <dlfcn.h>
#endif

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

using namespace hiprt_api_test;

namespace {

constexpr const char* kSource = R"(
#include <hiprt/hiprt_device.h>
#include <hiprt/hiprt_vec.h>
#include <own/factor.h>
__device__ bool sphere(const hiprtRay& ray, const void* data, void* payload, hiprtHit& hit) {
  hit.t = FACTOR * *static_cast<const float*>(data);
  return true;
}
__device__ bool noFirst(const hiprtRay& ray, const void* data, void* payload, const hiprtHit& hit) {
  return hit.primID == 0u;
}
extern "C" __global__ void Trace(hiprtScene scene, hiprtFuncTable table, const hiprtRay* rays, hiprtHit* hits) {
  const uint32_t i = threadIdx.x;
  hiprtSceneTraversalClosest traversal(scene, rays[i], hiprtFullRayMask, hiprtTraversalHintDefault, nullptr, table);
  hits[i] = traversal.getNextHit();
}
)";

/// One block.
void launch(hiprtApiFunction function, unsigned threads, void** arguments) {
#if defined(__HIP_PLATFORM_NVIDIA__)
  using Launch =
      int (*)(void*, unsigned, unsigned, unsigned, unsigned, unsigned, unsigned, unsigned, void*, void**, void**);
  void* const driver = dlopen("libcuda.so.1", RTLD_NOW);
  REQUIRE(driver != nullptr);
  const auto start = reinterpret_cast<Launch>(dlsym(driver, "cuLaunchKernel"));
  REQUIRE(start(function, 1, 1, 1, threads, 1, 1, 0, nullptr, arguments, nullptr) == 0);
#else
  HIP_OK(hipModuleLaunchKernel(static_cast<hipFunction_t>(function), 1, 1, 1, threads, 1, 1, 0, nullptr, arguments,
                               nullptr));
#endif
  HIP_OK(hipDeviceSynchronize());
}

/// Traces three rays with functions of type 1, which reports t = 3 * data, and of type 3, which rejects primitive 0.
void check_functions(Program& program, hiprtApiFunction function) {
  const std::vector<float> boxes{0, 0, 0, 1, 1, 1};
  hiprtGeometryBuildInput balls;
  balls.type = hiprtPrimitiveTypeAABBList;
  balls.geomType = 1;
  balls.primitive.aabbList = {program.copy(boxes), 1, 24};
  auto triangle = Mesh::triangle().upload(program);
  triangle.geomType = 3;
  auto plain = Mesh::triangle().upload(program);
  SceneArraysOnHost arrays;
  for (const auto* input : {&balls, &triangle, &plain}) arrays.add(program.build(*input));
  arrays.move({0, 0, 0});
  arrays.move({2, 0, 0});
  arrays.move({4, 0, 0});
  hiprtScene scene = program.build(arrays.upload(program));
  hiprtFuncTable table = nullptr;
  HIPRT_OK(hiprtCreateFuncTable(program.context, 4, 1, table));
  HIPRT_OK(hiprtSetFuncTable(program.context, table, 1, 0, {program.copy(std::vector<float>{2.0f}), nullptr}));
  const std::vector<hiprtRay> rays{ray_at(0.5f, 0.5f), ray_at(2.2f, 0.2f), ray_at(4.2f, 0.2f)};
  const hiprtRay* device_rays = program.copy(rays);
  auto* hits = static_cast<hiprtHit*>(program.take(rays.size() * sizeof(hiprtHit)));
  void* arguments[] = {&scene, &table, &device_rays, &hits};
  launch(function, 3, arguments);
  const auto result = program.read(hits, rays.size());
  CHECK(result[0].t == Approx(6.0));
  CHECK_FALSE(result[1].hasHit());
  CHECK((result[2].t == Approx(10.0) && result[2].instanceID == 2));
  HIPRT_OK(hiprtDestroyFuncTable(program.context, table));
}

}  // namespace

TEST_CASE("kernels from source, with generated dispatchers, headers and options", "[run-time]") {
  Program program;
  const std::string cache = (std::filesystem::temp_directory_path() / "hiprt_api_cache").string();
  HIPRT_OK(hiprtSetCacheDirPath(program.context, cache.c_str()));
  const char* const headers[] = {"#pragma once\n#define FACTOR (TWO * 1.5f)\n", "#error of another library\n"};
  const char* const includes[] = {"own/factor.h", "hiprt/hiprt_device.h"};
  const char* options[] = {"-DTWO=2.0f", "-std=c++17"};
  const char* names[] = {"Trace"};
  hiprtFuncNameSet sets[4];
  sets[1].intersectFuncName = "sphere";
  sets[3].filterFuncName = "noFirst";
  hiprtApiFunction function = nullptr, again = nullptr, other = nullptr;
  hiprtApiModule module = nullptr;
  const auto compile = [&](const char* source, hiprtApiFunction& out) {
    return hiprtBuildTraceKernels(program.context, 1, names, source, "same name", 2, const_cast<const char**>(headers),
                                  const_cast<const char**>(includes), 2, options, 4, 1, sets, &out, &module, true);
  };
  HIPRT_OK(compile(kSource, function));
  HIPRT_OK(compile(kSource, again));
  CHECK(function == again);
  // The module's name is no key: another source is another module.
  const std::string changed = std::string(kSource) + "\n__device__ int more;\n";
  HIPRT_OK(compile(changed.c_str(), other));
  CHECK(other != function);
  CHECK(compile("this does not compile", other) == hiprtErrorInternal);

  check_functions(program, function);
  std::filesystem::remove_all(cache);
}

TEST_CASE("kernels from code of the program, linked to generated dispatchers", "[run-time]") {
  Program program;
#if defined(__HIP_PLATFORM_NVIDIA__)
  constexpr const char* kKinds[] = {"cubin", "fatbin"};
#else
  constexpr const char* kKinds[] = {"bitcode", "bundle"};
#endif
  const char* const folder = std::getenv("HIPRT_TEST_LINKED");
  const char* names[] = {"LinkedTrace"};
  hiprtFuncNameSet sets[4];
  sets[1].intersectFuncName = "linkedSphere";
  sets[3].filterFuncName = "linkedNoFirst";
  for (const char* kind : kKinds) {
    CAPTURE(kind);
    std::ifstream file((folder != nullptr ? folder : HIPRT_TEST_LINKED) + std::string("/linked.") + kind,
                       std::ios::binary);
    REQUIRE(file);
    const std::string code{std::istreambuf_iterator<char>(file), {}};
    hiprtApiFunction function = nullptr, again = nullptr;
    const auto link = [&](const std::string& from, hiprtApiFunction& out) {
      return hiprtBuildTraceKernelsFromBitcode(program.context, 1, names, "linked", from.data(), from.size(), 4, 1,
                                               sets, &out, false);
    };
    HIPRT_OK(link(code, function));
    HIPRT_OK(link(code, again));
    CHECK(function == again);
    check_functions(program, function);
    CHECK(link("no code", again) == hiprtErrorInternal);
    CHECK(link(code.substr(0, code.size() / 4), again) == hiprtErrorInternal);
    names[0] = "NotThere";
    CHECK(link(code, again) == hiprtErrorInternal);
    names[0] = "LinkedTrace";
  }
}

TEST_CASE("missing arguments of compilations") {
  Program program;
  hiprtApiFunction function = nullptr;
  const char* names[] = {"Trace"};
  CHECK(hiprtBuildTraceKernels(program.context, 1, names, nullptr, "m", 0, nullptr, nullptr, 0, nullptr, 0, 1, nullptr,
                               &function, nullptr, false) == hiprtErrorInvalidParameter);
  CHECK(hiprtBuildTraceKernels(program.context, 1, names, kSource, nullptr, 0, nullptr, nullptr, 0, nullptr, 0, 1,
                               nullptr, &function, nullptr, false) == hiprtErrorInvalidParameter);
  CHECK(hiprtBuildTraceKernels(program.context, 1, names, kSource, "m", 0, nullptr, nullptr, 0, nullptr, 0, 1, nullptr,
                               nullptr, nullptr, false) == hiprtErrorInvalidParameter);
}

#if defined(__HIP_PLATFORM_NVIDIA__)
TEST_CASE("the context that was current before is current again") {
  HIP_OK(hipDeviceSynchronize());
  void* const driver = dlopen("libcuda.so.1", RTLD_NOW);
  REQUIRE(driver != nullptr);
  using Retain = int (*)(void**, int);
  using Get = int (*)(void**);
  using Set = int (*)(void*);
  const auto retain = reinterpret_cast<Retain>(dlsym(driver, "cuDevicePrimaryCtxRetain"));
  const auto get = reinterpret_cast<Get>(dlsym(driver, "cuCtxGetCurrent"));
  const auto set = reinterpret_cast<Set>(dlsym(driver, "cuCtxSetCurrent"));
  void *primary = nullptr, *current = nullptr;
  REQUIRE(retain(&primary, 0) == 0);
  REQUIRE(set(nullptr) == 0);
  hiprtContext context = nullptr;
  HIPRT_OK(hiprtCreateContext(HIPRT_API_VERSION, {primary, 0, kDeviceType}, context));
  hiprtFuncTable table = nullptr;
  HIPRT_OK(hiprtCreateFuncTable(context, 2, 2, table));
  REQUIRE(get(&current) == 0);
  CHECK(current == nullptr);
  REQUIRE(set(primary) == 0);
  HIPRT_OK(hiprtDestroyFuncTable(context, table));
  REQUIRE(get(&current) == 0);
  CHECK(current == primary);
  HIPRT_OK(hiprtDestroyContext(context));
}
#endif

TEST_CASE("too little device memory", "[.memory]") {
  Program program;
  hiprtGeometryBuildInput boxes;
  boxes.type = hiprtPrimitiveTypeAABBList;
  boxes.primitive.aabbList = {program.take(24), 100000000, 24};
  std::vector<hiprtGeometry> made;
  hiprtError result = hiprtSuccess;
  for (unsigned i = 0; i < 16 && result == hiprtSuccess; ++i) {
    hiprtGeometry geometry = nullptr;
    result = hiprtCreateGeometry(program.context, boxes, {hiprtBuildFlagBitPreferFastBuild, 0}, geometry);
    if (result == hiprtSuccess) made.push_back(geometry);
  }
  CHECK(result == hiprtErrorOutOfDeviceMemory);
  for (const hiprtGeometry geometry : made) HIPRT_OK(hiprtDestroyGeometry(program.context, geometry));
}
