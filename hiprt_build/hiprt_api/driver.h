#pragma once
/// The calls of the driver that the HIP runtime's names do not cover: contexts and modules. Internal.

#include <hiprt_build/gpu/compile.h>
#include <hiprt_build/gpu/error.h>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace hiprt::api {

using build::Error;
using build::ErrorCode;
using build::Result;

/// The driver that this build serves.
#if defined(__HIP_PLATFORM_NVIDIA__)
inline constexpr bool kServesNvidia = true;
#else
inline constexpr bool kServesNvidia = false;
#endif

/// @return kNoDevice without a driver, or without a GPU.
Result<void> check_driver();

/// While it lives the caller's context is current on this thread. Then the context that was current before is again.
class CurrentContext {
 public:
  /// @param context of the driver; nullptr: the primary one of the device.
  CurrentContext(void* context, int device);
  ~CurrentContext();
  CurrentContext(const CurrentContext&) = delete;
  CurrentContext& operator=(const CurrentContext&) = delete;

  const Result<void>& result() const { return result_; }

 private:
  bool pushed_ = false;
  int previous_ = -1;
  Result<void> result_;
};

/// hipModuleLoadData() or cuModuleLoadData().
Result<void*> load_module(std::span<const std::byte> code);
Result<void*> find_function(void* module, const char* name);
void unload_module(void* module) noexcept;

/// Compiles a source and links it to code of the program: on AMD LLVM bitcode, on NVIDIA PTX, a cubin or a fat binary,
/// all relocatable.
/// @return code for load_module(), or what the compiler or the linker says.
Result<std::vector<std::byte>> compile_and_link(const std::string& source, gpu::CompileOptions options,
                                                std::span<const std::byte> program);

}  // namespace hiprt::api
