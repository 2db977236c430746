#pragma once
/// The host object behind a hiprtContext. Internal.

#include <hiprt_build/hiprt_api/driver.h>
#include <hiprt_build/hiprt_api/host_buffers.h>
#include <hiprt_build/hiprt_api/objects.h>

#include <hiprt/hiprt.h>

#include <atomic>
#include <map>
#include <mutex>
#include <string>

struct hiprtContextObject {
  void* driver_context = nullptr;
  int device = 0;
  std::string architecture;  ///< "sm_90", "gfx1030".
  std::atomic<hiprtLogLevel> log_level{hiprtLogLevelNone};

  hiprt::api::ObjectTable geometries;
  hiprt::api::ObjectTable scenes;
  hiprt::api::HostBuffers host_buffers;

  /// Of function tables: their numbers of types.
  struct TableSize {
    std::uint32_t geometry_types = 0, ray_types = 0;
  };
  std::mutex tables_mutex;
  std::map<void*, TableSize> tables;

  std::mutex modules_mutex;
  std::map<std::string, void*> modules;  ///< By content.
  std::string cache_folder;              ///< Empty: the default of compile_kernels().
};

namespace hiprt::api {

/// Prints a line if the level asks for it.
void log(const hiprtContextObject& context, hiprtLogLevelBits level, const std::string& message);

hiprtError code_of(const Error& error);

/// Runs the body of a function of the interface: with the context current, without exceptions, with errors in the log.
/// @param body returns a Result<void>.
template <class Body> hiprtError run(hiprtContext context, const char* function, const Body& body) noexcept {
  try {
    const CurrentContext current(context->driver_context, context->device);
    Result<void> result = current.result();
    if (result) result = body();
    if (result) return hiprtSuccess;
    log(*context, hiprtLogLevelError, std::string(function) + ": " + result.error().message);
    return code_of(result.error());
  } catch (const std::bad_alloc&) {
    return hiprtErrorOutOfHostMemory;
  } catch (...) {
    return hiprtErrorInternal;
  }
}

}  // namespace hiprt::api
