#include <hiprt_build/gpu/device.h>
#include <hiprt_build/hiprt_api/context.h>

#include <cstdio>

namespace hiprt::api {

void log(const hiprtContextObject& context, hiprtLogLevelBits level, const std::string& message) {
  if ((context.log_level & static_cast<hiprtLogLevel>(level)) == 0) return;
  const char* const name = level == hiprtLogLevelError ? "error" : level == hiprtLogLevelWarn ? "warning" : "info";
  std::printf("hiprt %s: %s\n", name, message.c_str());
}

hiprtError code_of(const Error& error) {
  return error.code == ErrorCode::kOutOfMemory ? hiprtErrorOutOfDeviceMemory : hiprtErrorInternal;
}

namespace {

/// There is no context yet, so no log level.
hiprtError refuse(const std::string& why) {
  std::fprintf(stderr, "hiprtCreateContext: %s\n", why.c_str());
  return hiprtErrorInternal;
}

hiprtError create(const hiprtContextCreationInput& input, hiprtContext& out) {
  const bool nvidia = input.deviceType == hiprtDeviceNVIDIA;
  if (nvidia != kServesNvidia)
    return refuse(std::string("deviceType is ") + (nvidia ? "NVIDIA" : "AMD") + ", but this library was built for " +
                  (kServesNvidia ? "NVIDIA" : "AMD"));
  if (auto driver = check_driver(); !driver) return refuse(driver.error().message);
  auto context = std::make_unique<hiprtContextObject>();
  context->driver_context = input.ctxt;
  context->device = input.device;
  const CurrentContext current(input.ctxt, input.device);
  if (!current.result()) return refuse(current.result().error().message);
  const auto device = gpu::current_device();
  if (!device) return refuse(device.error().message);
  context->architecture = device->architecture;
  out = context.release();
  return hiprtSuccess;
}

}  // namespace
}  // namespace hiprt::api

hiprtError hiprtCreateContext(uint32_t version, const hiprtContextCreationInput& input, hiprtContext& out) {
  if (version != HIPRT_API_VERSION) return hiprtErrorInvalidApiVersion;
  try {
    return hiprt::api::create(input, out);
  } catch (...) {
    return hiprtErrorOutOfHostMemory;
  }
}

hiprtError hiprtDestroyContext(hiprtContext context) {
  if (context == nullptr) return hiprtErrorInvalidParameter;
  const hiprtError done = hiprt::api::run(context, "hiprtDestroyContext", [&]() -> hiprt::api::Result<void> {
    for (const auto& [content, module] : context->modules) hiprt::api::unload_module(module);
    context->geometries.abandon();
    context->scenes.abandon();
    context->host_buffers.clear();
    return {};
  });
  delete context;
  return done;
}

hiprtError hiprtSetLogLevel(hiprtContext context, hiprtLogLevel level) {
  if (context == nullptr) return hiprtErrorInvalidParameter;
  context->log_level = level;
  return hiprtSuccess;
}

hiprtError hiprtSetCacheDirPath(hiprtContext context, const char* path) {
  if (context == nullptr || path == nullptr) return hiprtErrorInvalidParameter;
  if (*path == '\0') return hiprtSuccess;
  try {
    const std::scoped_lock lock(context->modules_mutex);
    context->cache_folder = path;
    return hiprtSuccess;
  } catch (...) {
    return hiprtErrorOutOfHostMemory;
  }
}
