#pragma once
/// Symbols of the shared library are hidden unless marked. On Windows MinGW's linker exports all.

#if defined(HIPRT_BUILD_STATIC) || !defined(__GNUC__) || defined(_WIN32)
#define HIPRT_BUILD_API
#else
#define HIPRT_BUILD_API __attribute__((visibility("default")))
#endif
