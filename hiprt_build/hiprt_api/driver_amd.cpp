// Modules and devices of AMD's runtime. Its contexts are its devices.

#include <hiprt_build/hiprt_api/driver.h>

namespace hiprt::api {

Result<void> check_driver() {
  int devices = 0;
  if (auto done = gpu::check(hipGetDeviceCount(&devices), "hipGetDeviceCount"); !done)
    return gpu::fail(ErrorCode::kNoDevice, done.error().message);
  if (devices == 0) return gpu::fail(ErrorCode::kNoDevice, "hipGetDeviceCount: 0, no GPU can be used here");
  return {};
}

CurrentContext::CurrentContext(void*, int device) {
  result_ = gpu::check(hipGetDevice(&previous_), "hipGetDevice");
  if (result_ && previous_ != device) {
    result_ = gpu::check(hipSetDevice(device), "hipSetDevice", "device ", device);
    pushed_ = result_.has_value();
  }
}

CurrentContext::~CurrentContext() {
  if (pushed_) static_cast<void>(hipSetDevice(previous_));
}

Result<void*> load_module(std::span<const std::byte> code) {
  hipModule_t module = nullptr;
  if (auto done = gpu::check(hipModuleLoadData(&module, code.data()), "hipModuleLoadData"); !done)
    return tl::unexpected(std::move(done.error()));
  return static_cast<void*>(module);
}

Result<void*> find_function(void* module, const char* name) {
  hipFunction_t function = nullptr;
  if (auto done = gpu::check(hipModuleGetFunction(&function, static_cast<hipModule_t>(module), name),
                             "hipModuleGetFunction", "function ", name);
      !done)
    return tl::unexpected(std::move(done.error()));
  return static_cast<void*>(function);
}

void unload_module(void* module) noexcept { static_cast<void>(hipModuleUnload(static_cast<hipModule_t>(module))); }

Result<std::vector<std::byte>> compile_and_link(const std::string& source, gpu::CompileOptions options,
                                                std::span<const std::byte> program) {
  options.bitcode = program;
  auto compiled = gpu::compile_kernels(source, {}, options);
  if (!compiled) return tl::unexpected(std::move(compiled.error()));
  return std::move(compiled->code);
}

}  // namespace hiprt::api
