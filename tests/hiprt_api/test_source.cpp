// The source around the caller's kernels: what it says, and that run-time compilers take it. Needs no GPU.

#include <hiprt_build/gpu/compile.h>
#include <hiprt_build/hiprt_api/trace_source.h>
#include <tests/catch.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

using namespace hiprt;
using Catch::Matchers::Contains;

namespace {

constexpr const char* kSource = R"(#include <hiprt/hiprt_device.h>
__device__ bool circle(const hiprtRay& ray, const void* data, void* payload, hiprtHit& hit) { return true; }
__device__ bool cutout(const hiprtRay& ray, const void* data, void* payload, const hiprtHit& hit) { return false; }
extern "C" __global__ void Trace(hiprtScene scene, hiprtFuncTable table, hiprtRay ray, hiprtHit* hit) {
  hiprtSceneTraversalClosest traversal(scene, ray, hiprtFullRayMask, hiprtTraversalHintDefault, nullptr, table);
  *hit = traversal.getNextHit();
}
)";

}  // namespace

TEST_CASE("dispatchers have a case for each named function") {
  hiprtFuncNameSet sets[4];
  sets[1].intersectFuncName = "circle";
  sets[2].intersectFuncName = "";
  sets[3].intersectFuncName = "circle";
  sets[3].filterFuncName = "cutout";
  const std::string text = api::dispatcher_of({2, 2, sets});
  CHECK_THAT(text, Contains("case 1u: return circle(ray, tableHeader.funcDataSets[1u].intersectFuncData") &&
                       Contains("case 3u: return circle(ray, tableHeader.funcDataSets[3u].intersectFuncData") &&
                       Contains("case 3u: return cutout(ray, tableHeader.funcDataSets[3u].filterFuncData"));
  CHECK(text.find("case 0u") == std::string::npos);
  CHECK(text.find("case 2u") == std::string::npos);
  const std::string none = api::dispatcher_of({0, 1, nullptr});
  CHECK_THAT(none, Contains("intersectFunc") && Contains("filterFunc"));
  CHECK(none.find("case") == std::string::npos);
}

TEST_CASE("programs compile, whatever headers lie below an include folder") {
  // A folder with headers of the same names: those of the library come first.
  const auto folder = std::filesystem::temp_directory_path() / "hiprt_api_source";
  std::filesystem::create_directories(folder / "hiprt");
  for (const char* name : {"hiprt_device.h", "hiprt_vec.h", "hiprt_types.h"})
    std::ofstream(folder / "hiprt" / name) << "#error another library's header\n";
  hiprtFuncNameSet sets[2];
  sets[1] = {"circle", "cutout"};
  const std::string program = api::program_of({2, 1, sets}, kSource, "a \"name\" \\ of a module");
  for (const char* architecture : {"sm_90", "gfx1030"}) {
    CAPTURE(architecture);
    const auto kernels = gpu::compile_kernels(program, {},
                                              {.architecture = architecture,
                                               .flags = {"-I" + folder.string(), "-D__USE_HIP__"},
                                               .file = "module",
                                               .cached = false});
    if (!kernels && kernels.error().code == build::ErrorCode::kBackend) continue;  // The compiler is not here.
    INFO((kernels ? std::string() : kernels.error().message));
    CHECK(kernels.has_value());
  }
  std::filesystem::remove_all(folder);
}
