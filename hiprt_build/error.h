#pragma once
/// Errors of the builder library are values.

#include <hiprt_build/export.h>

#include <tl/expected.hpp>

#include <string>

namespace hiprt::build {

enum class ErrorCode {
  kInvalidInput,  ///< An index past the vertices, an option out of range, a malformed file.
  kTooLarge,      ///< More than a 32-bit node reference, geometry id or primitive id can express.
  kOutOfMemory,
  kCancelled,  ///< The progress callback returned that the work should stop.
  kIo,         ///< A file could not be opened, read, written or renamed.
  kBackend,    ///< A library that we use (Embree) reported an error.
  kNoDevice,   ///< No GPU, or no driver for it.
  kGpu,        ///< The GPU runtime (HIP, CUDA) reported an error.
};

/// @return a short name, for example "invalid input".
HIPRT_BUILD_API const char* name(ErrorCode code);

struct Error {
  ErrorCode code;
  std::string message;  ///< What is wrong, where, and the limit, without a full stop or newline at the end.
};

/// A value or an error.
template <class T> using Result = tl::expected<T, Error>;

}  // namespace hiprt::build
