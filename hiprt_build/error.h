#pragma once
/// Errors of the builder library are values.

#include <hiprt_build/export.h>

#include <tl/expected.hpp>

#include <string>

namespace hiprt::build {

enum class ErrorCode {
  kInvalidInput,  ///< An index past the vertices, an option out of range, a malformed file.
  kTooLarge,      ///< More than a 32-bit node reference, geometry id or primitive id can address.
  kOutOfMemory,
  kCancelled,  ///< The progress callback asked to stop.
  kIo,         ///< A file could not be opened, read, written or renamed.
  kBackend,    ///< A library beneath (Embree) reported an error.
  kNoDevice,   ///< No GPU, or no driver for it.
  kGpu,        ///< The GPU runtime (HIP, CUDA) reported an error.
};

/// @return e.g. "invalid input".
HIPRT_BUILD_API const char* name(ErrorCode code);

struct Error {
  ErrorCode code;
  std::string message;  ///< What, where and which limit, without a trailing full stop or newline.
};

/// A value, or what went wrong.
template <class T> using Result = tl::expected<T, Error>;

}  // namespace hiprt::build
