#pragma once
/// Symbols of the shared library are hidden unless marked.

#if defined(HIPRT_BUILD_STATIC) || !defined(__GNUC__)
#define HIPRT_BUILD_API
#else
#define HIPRT_BUILD_API __attribute__((visibility("default")))
#endif
