// Kernels that are compiled at run time: code, names, messages, and the cache.
//
// [.child] is started by the test of processes.

#include <hiprt_build/gpu/compile.h>

#include <tests/catch.h>
#include <tests/oracle/random.h>
#include <tests/tools/temp_folder.h>

#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

using namespace hiprt;
using build::ErrorCode;
using gpu::CompileOptions;
namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t kSeed = 20261126;

constexpr const char* kSmall = R"(template <class T> __global__ void twice(T* value) { *value *= FACTOR; }
extern "C" __global__ void once(float* value) { *value += 1; }
)";
constexpr const char* kTracer = R"(#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>
struct Tracer : hiprt::Policies {};
template <class P>
__global__ void trace(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = hiprt::closest_hit<P>(scene, rays[i]);
}
)";
/// A program of HIPRT: it needs no folder of headers either.
constexpr const char* kHiprt = R"(#include <hiprt/impl/hiprt_device_impl.h>
#include <hiprt/hiprt_vec.h>
HIPRT_DEVICE bool intersectFunc(uint32_t, uint32_t, const hiprtFuncTableHeader&, const hiprtRay&, void*, hiprtHit&) {
  return false;
}
HIPRT_DEVICE bool filterFunc(uint32_t, uint32_t, const hiprtFuncTableHeader&, const hiprtRay&, void*, const hiprtHit&) {
  return false;
}
extern "C" __global__ void TraceKernel(hiprtScene scene, float3 origin, float3 direction, hiprtHit* hit) {
  hiprtRay ray;
  ray.origin = origin;
  ray.direction = 2.0f * direction;
  hiprtSceneTraversalClosest traversal(scene, ray);
  *hit = traversal.getNextHit();
}
)";
const std::vector<std::string> kNames{"twice<float>", "twice<int>"};

CompileOptions options_of(const std::string& architecture) {
  return {.architecture = architecture, .flags = {"-DFACTOR=2"}, .cached = false};
}

/// The architectures whose compiler is here. tools/check lists the others.
const std::vector<std::string>& architectures() {
  static const auto all = [] {
    std::vector<std::string> found;
    for (const char* architecture : {"sm_90", "compute_90", "gfx1030"}) {
      const auto kernels = gpu::compile_kernels("\n", {}, options_of(architecture));
      if (kernels || kernels.error().code != ErrorCode::kBackend)
        found.push_back(architecture);
      else
        std::printf("SKIPPED: %s: no compiler here\n", architecture);
    }
    return found;
  }();
  return all;
}

bool begins_with(const std::vector<std::byte>& code, std::string_view text) {
  return code.size() >= text.size() && std::equal(text.begin(), text.end(), reinterpret_cast<const char*>(code.data()));
}

std::size_t files_in(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

fs::path only_file_in(const fs::path& folder) {
  REQUIRE(files_in(folder) == 1);
  return fs::directory_iterator(folder)->path();
}

}  // namespace

TEST_CASE("kernels with hiprt's headers compile, wherever the program runs") {
  // A header of this name in the working folder is not read.
  const test::TempFolder folder;
  fs::create_directory(folder.path() / "hiprt_device");
  std::ofstream(folder.path() / "hiprt_device/hiprt_device.h") << "#error the wrong header\n";
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());
  for (const std::string& architecture : architectures()) {
    CAPTURE(architecture);
    const std::vector<std::string> names{"trace<Tracer>"};
    const auto kernels = gpu::compile_kernels(kTracer, names, options_of(architecture));
    INFO((kernels ? std::string() : kernels.error().message));
    REQUIRE(kernels.has_value());
    CHECK(kernels->code.size() > 4096);
    if (architecture.starts_with("sm_"))
      CHECK(begins_with(kernels->code,
                        "\x7f"
                        "ELF"));
    if (architecture.starts_with("compute_")) CHECK(begins_with(kernels->code, "//"));
    REQUIRE(kernels->names.size() == 1);
    CHECK(kernels->names[0].find("trace") != std::string::npos);
    CHECK(kernels->names[0].starts_with("_Z"));
  }
  fs::current_path(before);
}

TEST_CASE("kernels with HIPRT's names compile") {
  for (const std::string& architecture : architectures()) {
    CAPTURE(architecture);
    const auto kernels = gpu::compile_kernels(kHiprt, {}, options_of(architecture));
    INFO((kernels ? std::string() : kernels.error().message));
    REQUIRE(kernels.has_value());
    CHECK(kernels->code.size() > 4096);
  }
}

TEST_CASE("names, and headers of the program") {
  for (const std::string& architecture : architectures()) {
    CAPTURE(architecture);
    CompileOptions options = options_of(architecture);
    options.headers = {{"own/numbers.h", "#define FOUR 4\n"}};
    options.flags = {"-DFACTOR=FOUR"};
    const auto kernels = gpu::compile_kernels(std::string("#include <own/numbers.h>\n") + kSmall, kNames, options);
    INFO((kernels ? std::string() : kernels.error().message));
    REQUIRE(kernels.has_value());
    REQUIRE(kernels->names.size() == 2);
    CHECK(kernels->names[0] != kernels->names[1]);
    CHECK_FALSE(kernels->from_cache);
    CHECK(gpu::compile_kernels("extern \"C\" __global__ void once() {}", {}, options).has_value());
  }
}

TEST_CASE("what does not compile is an error with the compiler's messages") {
  for (const std::string& architecture : architectures()) {
    CAPTURE(architecture);
    CompileOptions options = options_of(architecture);
    options.file = "my_kernels.hip";
    const auto kernels = gpu::compile_kernels("\n\n__global__ void f() { return missing; }\n", {}, options);
    REQUIRE_FALSE(kernels.has_value());
    CHECK(kernels.error().code == ErrorCode::kInvalidInput);
    const std::string& message = kernels.error().message;
    CAPTURE(message);
    CHECK(message.find("my_kernels.hip") != std::string::npos);
    CHECK(message.find("missing") != std::string::npos);
    CHECK(message.find(architecture) != std::string::npos);

    const std::vector<std::string> unknown{"thrice<float>"};
    const auto no_kernel = gpu::compile_kernels(kSmall, unknown, options);
    REQUIRE_FALSE(no_kernel.has_value());
    CHECK(no_kernel.error().code == ErrorCode::kInvalidInput);
    CHECK(no_kernel.error().message.find("thrice") != std::string::npos);
  }
}

TEST_CASE("invalid arguments") {
  const auto error = [](std::string_view source, const std::vector<std::string>& names, const CompileOptions& options) {
    const auto kernels = gpu::compile_kernels(source, names, options);
    REQUIRE_FALSE(kernels.has_value());
    CHECK(kernels.error().code == ErrorCode::kInvalidInput);
    return kernels.error().message;
  };
  CHECK(error("\n", {}, options_of("")) == "architecture '': must begin with gfx, sm_ or compute_");
  CHECK(error("\n", {}, options_of("x86-64")) == "architecture 'x86-64': must begin with gfx, sm_ or compute_");
  CHECK(error("", {}, options_of("sm_90")) == "the source 'kernels.hip' is empty");
  CHECK(error(std::string_view("a\0b", 3), {}, options_of("sm_90")) == "the source 'kernels.hip' has a byte 0");
  CHECK(error("\n", {""}, options_of("sm_90")) == "the name of a kernel is empty or has a byte 0");
  CompileOptions options = options_of("sm_90");
  options.headers = {{"", "text"}};
  CHECK(error("\n", {}, options) == "header '': its name is empty, or it has a byte 0");
  options = options_of("gfx1030");
  options.flags = {std::string("a\0b", 3)};
  CHECK(error("\n", {}, options) == "an option of the compiler has a byte 0");
}

TEST_CASE("a compiler that is not there") {
  CompileOptions options = options_of("sm_90");
  options.library = "/nowhere/libnvrtc.so";
  auto kernels = gpu::compile_kernels(kSmall, {}, options);
  REQUIRE_FALSE(kernels.has_value());
  CHECK(kernels.error().code == ErrorCode::kBackend);
  CHECK(kernels.error().message.find("/nowhere/libnvrtc.so") != std::string::npos);
  options.library = "libm.so.6";
  kernels = gpu::compile_kernels(kSmall, {}, options);
  REQUIRE_FALSE(kernels.has_value());
  CHECK(kernels.error().message == "cannot load NVRTC:\n  libm.so.6: it lacks nvrtcGetErrorString");
}

TEST_CASE("the cache finds what was compiled of the same, and nothing else") {
  for (const std::string& architecture : architectures()) {
    CAPTURE(architecture);
    const test::TempFolder folder;
    CompileOptions options = options_of(architecture);
    options.cached = true;
    options.cache = (folder.path() / "a/b").string();
    const auto compile = [&](const std::string& source = kSmall, const std::vector<std::string>& names = kNames) {
      auto kernels = gpu::compile_kernels(source, names, options);
      INFO((kernels ? std::string() : kernels.error().message));
      REQUIRE(kernels.has_value());
      return std::move(*kernels);
    };
    const auto first = compile(), second = compile();
    CHECK_FALSE(first.from_cache);
    CHECK(second.from_cache);
    CHECK(first.code == second.code);
    CHECK(first.names == second.names);
    CHECK(first.log == second.log);

    CHECK_FALSE(compile(std::string(kSmall) + "\n").from_cache);
    CHECK_FALSE(compile(kSmall, {kNames[0]}).from_cache);
    const CompileOptions before = options;
    options.flags.push_back("-DOTHER");
    CHECK_FALSE(compile().from_cache);
    options = before;
    options.headers = {{"own.h", "a"}};
    CHECK_FALSE(compile().from_cache);
    options.headers = {{"own.h", "b"}};
    CHECK_FALSE(compile().from_cache);
    options.headers = {{"own.ha", ""}};
    CHECK_FALSE(compile().from_cache);
    options = before;
    options.file = "other.hip";
    CHECK_FALSE(compile().from_cache);
    options = before;
    CHECK(compile().from_cache);
    CHECK(files_in(options.cache) == 8);
    options.cached = false;
    CHECK_FALSE(compile().from_cache);
    CHECK(files_in(options.cache) == 8);
  }
}

TEST_CASE("damaged files of the cache are compiled again") {
  const std::vector<std::string>& all = architectures();
  if (all.empty()) return;
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  const test::TempFolder folder;
  CompileOptions options = options_of(all.front());
  options.cached = true;
  options.cache = folder.path().string();
  const auto whole = gpu::compile_kernels(kSmall, kNames, options);
  REQUIRE(whole.has_value());
  const fs::path path = only_file_in(folder.path());
  std::string content;
  {
    std::ifstream file(path, std::ios::binary);
    content.assign(std::istreambuf_iterator<char>(file), {});
  }
  for (unsigned i = 0; i < 12; ++i) {
    std::string damaged = content;
    const auto size = static_cast<std::uint32_t>(content.size());
    const std::uint32_t at = i < 4 ? 8 * i : random.below(size);
    CAPTURE(i, at);
    if (i % 3 == 2)
      damaged.resize(at);
    else
      damaged[at] = static_cast<char>(damaged[at] ^ (1 << random.below(8)));
    std::ofstream(path, std::ios::binary | std::ios::trunc) << damaged;
    const auto kernels = gpu::compile_kernels(kSmall, kNames, options);
    REQUIRE(kernels.has_value());
    CHECK_FALSE(kernels->from_cache);
    CHECK(kernels->names == whole->names);
    const auto again = gpu::compile_kernels(kSmall, kNames, options);
    REQUIRE(again.has_value());
    CHECK(again->from_cache);
    CHECK(again->code == kernels->code);
  }
}

TEST_CASE("a cache that cannot be used is no error") {
  const std::vector<std::string>& all = architectures();
  if (all.empty()) return;
  CompileOptions options = options_of(all.front());
  options.cached = true;
  options.cache = "/proc/there/is/no/such/folder";
  const auto kernels = gpu::compile_kernels(kSmall, kNames, options);
  REQUIRE(kernels.has_value());
  CHECK_FALSE(kernels->from_cache);
}

TEST_CASE("the cache's folder when none is named") {
  const std::vector<std::string>& all = architectures();
  if (all.empty()) return;
  const test::TempFolder folder;
  const auto set = [](const char* name, const std::string& value) { REQUIRE(::setenv(name, value.c_str(), 1) == 0); };
  CompileOptions options = options_of(all.front());
  options.cached = true;
  set("HOME", (folder.path() / "home").string());
  set("XDG_CACHE_HOME", (folder.path() / "xdg").string());
  REQUIRE(gpu::compile_kernels(kSmall, kNames, options).has_value());
  CHECK(files_in(folder.path() / "xdg/hiprt/kernels") == 1);
  // Relative paths do not count.
  set("XDG_CACHE_HOME", "relative");
  REQUIRE(gpu::compile_kernels(kSmall, kNames, options).has_value());
  CHECK(files_in(folder.path() / "home/.cache/hiprt/kernels") == 1);
  // ROCm 6's compiler caches other files there.
  CHECK_FALSE(fs::exists("relative/hiprt"));
}

TEST_CASE("compiles into the cache of the environment", "[.child]") {
  const char* const folder = std::getenv("HIPRT_TEST_CACHE");
  const char* const architecture = std::getenv("HIPRT_TEST_ARCHITECTURE");
  REQUIRE(folder != nullptr);
  REQUIRE(architecture != nullptr);
  CompileOptions options = options_of(architecture);
  options.cached = true;
  options.cache = folder;
  for (unsigned i = 0; i < 3; ++i) {
    const auto kernels = gpu::compile_kernels(kSmall, kNames, options);
    REQUIRE(kernels.has_value());
    CHECK(kernels->names.size() == 2);
  }
}

TEST_CASE("threads and processes share a cache") {
  for (const std::string& architecture : architectures()) {
    CAPTURE(architecture);
    const test::TempFolder folder;
    REQUIRE(::setenv("HIPRT_TEST_CACHE", folder.path().c_str(), 1) == 0);
    REQUIRE(::setenv("HIPRT_TEST_ARCHITECTURE", architecture.c_str(), 1) == 0);
    std::vector<pid_t> children;
    for (unsigned i = 0; i < 3; ++i) {
      const pid_t child = ::fork();
      REQUIRE(child >= 0);
      if (child == 0) {
        ::execl("/proc/self/exe", "test_compile", "[.child]", static_cast<char*>(nullptr));
        ::_exit(127);
      }
      children.push_back(child);
    }
    CompileOptions options = options_of(architecture);
    options.cached = true;
    options.cache = folder.path().string();
    bool right[4] = {};
    {
      std::vector<std::jthread> threads;
      threads.reserve(std::size(right));
      for (bool& mine : right)
        threads.emplace_back([&] {
          const auto kernels = gpu::compile_kernels(kSmall, kNames, options);
          mine = kernels.has_value() && kernels->names.size() == 2;
        });
    }
    for (const bool mine : right) CHECK(mine);
    for (const pid_t child : children) {
      int status = -1;
      REQUIRE(::waitpid(child, &status, 0) == child);
      CHECK(status == 0);
    }
    CHECK(only_file_in(folder.path()).extension() == ".kernels");
  }
}
