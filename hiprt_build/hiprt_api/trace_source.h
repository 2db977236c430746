#pragma once
/// The source text around the caller's kernels. Internal.

#include <hiprt/hiprt_types.h>

#include <cstdint>
#include <string>

namespace hiprt::api {

/// The intersect and filter functions of a program.
struct FunctionNames {
  std::uint32_t geometry_types = 0, ray_types = 0;
  const hiprtFuncNameSet* sets = nullptr;  ///< One for each pair of types, or nullptr.
};

/// @return the declarations of the named functions, and definitions of intersectFunc() and filterFunc() that call them.
std::string dispatcher_of(const FunctionNames& names);

/// @param source of the caller; @param file its name in the compiler's messages.
/// @return the whole program.
std::string program_of(const FunctionNames& names, const char* source, const char* file);

}  // namespace hiprt::api
