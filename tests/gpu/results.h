#pragma once
/// Unwraps results; the test fails with the error's message.

#include <hiprt_build/gpu/error.h>

#include <tests/catch.h>

#include <string>
#include <utility>

namespace hiprt::checks {

template <class T> T must(gpu::Result<T> result) {
  INFO((result ? std::string() : result.error().message));
  REQUIRE(result.has_value());
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

/// The error of a Result that has one.
template <class T> gpu::Error error_of(const gpu::Result<T>& result) {
  REQUIRE_FALSE(result.has_value());
  return result.error();
}

}  // namespace hiprt::checks
