#pragma once
/// Errors of the GPU runtime as values.

#include <hiprt_build/error.h>
#include <hiprt_build/gpu/hip.h>

#include <string>
#include <type_traits>
#include <utility>

namespace hiprt::gpu {

using build::Error;
using build::ErrorCode;
using build::Result;

namespace error_detail {

inline void append(std::string& text, const char* part) { text += part; }
inline void append(std::string& text, const std::string& part) { text += part; }
template <class Number>
requires std::is_arithmetic_v<Number>
void append(std::string& text, Number part) { text += std::to_string(part); }

/// Drops an error that cannot be reported, and clears it from the runtime's record.
inline void ignore(hipError_t status) {
  if (status != hipSuccess) static_cast<void>(hipGetLastError());
}

inline bool has_device() {
  int devices = 0;
  return hipGetDeviceCount(&devices) == hipSuccess && devices > 0;
}

/// Chooses the code of an error. Appends to its message that there is no GPU, or how much memory is free.
inline ErrorCode classify(hipError_t status, std::string& text) {
  ErrorCode code = ErrorCode::kGpu;
  std::size_t free_bytes = 0, total_bytes = 0;
  if (!has_device()) {
    code = ErrorCode::kNoDevice;
    text += ", no GPU can be used here";
  } else if (status == hipErrorOutOfMemory) {
    code = ErrorCode::kOutOfMemory;
    if (hipMemGetInfo(&free_bytes, &total_bytes) == hipSuccess)
      text += ", " + std::to_string(free_bytes) + " of " + std::to_string(total_bytes) + " bytes free";
  }
  static_cast<void>(hipGetLastError());
  return code;
}

}  // namespace error_detail

/// Makes an error. Its message joins the parts, which are strings and numbers.
template <class... Parts> tl::unexpected<Error> fail(ErrorCode code, const Parts&... parts) {
  Error error{code, {}};
  (error_detail::append(error.message, parts), ...);
  return tl::unexpected<Error>(std::move(error));
}

/// Turns the status of a HIP call into a Result.
///
///     return check(hipMalloc(&pointer, bytes), "hipMalloc", bytes, " bytes wanted");
///
/// The message reads "hipMalloc: hipErrorOutOfMemory (out of memory), 4096 bytes wanted, 512 of 1024 bytes free". Only
/// messages about memory end with the free bytes, which are those of the current device. The runtime's record of its
/// last error is cleared, so that later code does not take this error for its own.
/// @param call the function's name.
/// @param context strings and numbers: the request and its sizes. May be empty.
/// @return nothing, or kOutOfMemory, kNoDevice (no GPU, no driver) or kGpu.
template <class... Context> Result<void> check(hipError_t status, const char* call, const Context&... context) {
  if (status == hipSuccess) return {};
  const std::string error_name = hipGetErrorName(status), error_text = hipGetErrorString(status);
  std::string text = std::string(call) + ": " + error_name;
  if (error_text != error_name) text += " (" + error_text + ")";
  if constexpr (sizeof...(context) > 0) {
    text += ", ";
    (error_detail::append(text, context), ...);
  }
  const ErrorCode code = error_detail::classify(status, text);
  return tl::unexpected<Error>(Error{code, std::move(text)});
}

}  // namespace hiprt::gpu
