#include <hiprt_build/python/gpu/modules.h>

#include <hiprt_build/gpu/compile.h>
#include <hiprt_build/python/errors.h>
#include <hiprt_build/rtc/embedded_headers.h>

#include <map>
#include <mutex>
#include <tuple>
#include <utility>

namespace hiprt::gpu::rtc {
/// The headers of gpu/device. rtc/embed_headers.cmake writes the definition.
std::span<const EmbeddedHeader> embedded_python_headers();
}  // namespace hiprt::gpu::rtc

namespace hiprt::python::gpu {
namespace {

std::mutex kernels_mutex, paths_mutex;
std::map<std::tuple<Platform, int, std::string>, Function> kernels;
std::vector<std::string> compiler_paths;

std::vector<std::string> known_paths() {
  const std::lock_guard lock(paths_mutex);
  return compiler_paths;
}

build::Result<hiprt::gpu::CompiledKernels> compile(const std::string& source, hiprt::gpu::CompileOptions options) {
  auto compiled = hiprt::gpu::compile_kernels(source, {}, options);
  if (options.architecture.starts_with("gfx")) return compiled;
  for (const std::string& path : known_paths()) {
    if (compiled || compiled.error().code != build::ErrorCode::kBackend) break;
    options.library = path;
    auto again = hiprt::gpu::compile_kernels(source, {}, options);
    if (again || again.error().code != build::ErrorCode::kBackend) compiled = std::move(again);
  }
  return compiled;
}

}  // namespace

void set_compiler_paths(std::vector<std::string> paths) {
  const std::lock_guard lock(paths_mutex);
  compiler_paths = std::move(paths);
}

std::vector<std::byte> code_of(const KernelSource& source, const std::string& architecture) {
  hiprt::gpu::CompileOptions options{.architecture = architecture, .file = "hiprt_query.hip"};
  for (const auto& header : hiprt::gpu::rtc::embedded_python_headers())
    options.headers.push_back({header.name, header.text});
  if (!source.fuses) options.flags.push_back(architecture.starts_with("gfx") ? "-ffp-contract=off" : "--fmad=false");
  return value_of(compile(source.text, options)).code;
}

Function kernel_of(const Driver& driver, int device, const KernelSource& source) {
  const std::lock_guard lock(kernels_mutex);
  Function& kernel = kernels[{driver.platform(), device, source.text}];
  if (kernel == nullptr) kernel = driver.load(code_of(source, driver.architecture(device)).data(), kKernel);
  return kernel;
}

}  // namespace hiprt::python::gpu
