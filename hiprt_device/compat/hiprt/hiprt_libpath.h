#pragma once
// NOLINTBEGIN(misc-definitions-in-headers): one file of a program includes it.
/// Names of the libraries that Orochi's oroInitialize() tries, each list with a null at its end.
///
/// The arrays are variables with external linkage, as in HIPRT: include this header in one source file of a program.

#if defined(_WIN32)
const char* g_hip_paths[] = {"amdhip64_7.dll", "amdhip64_6.dll", "amdhip64.dll", nullptr};
const char* g_hiprtc_paths[] = {"hiprtc0701.dll", "hiprtc0700.dll", "hiprtc0604.dll",
                                "hiprtc0602.dll", "hiprtc0601.dll", "hiprtc0600.dll",
                                "hiprtc0507.dll", "hiprtc0505.dll", nullptr};
#else
const char* g_hip_paths[] = {"libamdhip64.so",   "/opt/rocm/lib/libamdhip64.so",
                             "libamdhip64.so.7", "libamdhip64.so.6",
                             "libamdhip64.so.5", nullptr};
const char* g_hiprtc_paths[] = {
    "libhiprtc.so",   "/opt/rocm/lib/libhiprtc.so", "libhiprtc.so.7", "libhiprtc.so.6", "libhiprtc.so.5",
    "libamdhip64.so", "libamdhip64.so.5",           nullptr};
#endif
// NOLINTEND(misc-definitions-in-headers)
