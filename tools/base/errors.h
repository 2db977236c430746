#pragma once
/// Short forms for errors that functions return.

#include <hiprt_build/error.h>

#include <string>
#include <utility>

namespace hiprt::tools {

inline tl::unexpected<build::Error> fail(build::ErrorCode code, std::string message) {
  return tl::unexpected<build::Error>(build::Error{code, std::move(message)});
}

inline tl::unexpected<build::Error> invalid_input(std::string message) {
  return fail(build::ErrorCode::kInvalidInput, std::move(message));
}

}  // namespace hiprt::tools
