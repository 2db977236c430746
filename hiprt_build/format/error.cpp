#include <hiprt_build/error.h>

namespace hiprt::build {

const char* name(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidInput:
      return "invalid input";
    case ErrorCode::kTooLarge:
      return "too large";
    case ErrorCode::kOutOfMemory:
      return "out of memory";
    case ErrorCode::kCancelled:
      return "cancelled";
    case ErrorCode::kIo:
      return "input or output error";
    case ErrorCode::kBackend:
      return "backend error";
    case ErrorCode::kNoDevice:
      return "no GPU";
    case ErrorCode::kGpu:
      return "GPU error";
  }
  return "unknown error";
}

}  // namespace hiprt::build
