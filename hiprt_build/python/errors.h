#pragma once
/// Errors of the library as Python exceptions: the classes of hiprt/_errors.py.

#include <hiprt_build/error.h>

#include <nanobind/nanobind.h>

#include <exception>
#include <string>
#include <utility>

namespace hiprt::python {

/// An Error on its way to Python.
class LibraryError : public std::exception {
 public:
  explicit LibraryError(build::Error error) : error_(std::move(error)) {}
  const build::Error& error() const { return error_; }
  const char* what() const noexcept override { return error_.message.c_str(); }

 private:
  build::Error error_;
};

[[noreturn]] inline void refuse(std::string message) {
  throw LibraryError({build::ErrorCode::kInvalidInput, std::move(message)});
}

/// The value of a result. Throws LibraryError.
template <class T> T value_of(build::Result<T> result) {
  if (!result) throw LibraryError(std::move(result.error()));
  if constexpr (!std::is_void_v<T>) return *std::move(result);
}

/// Makes nanobind raise a LibraryError as the exception of its code.
void register_errors();

}  // namespace hiprt::python
