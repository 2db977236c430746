#pragma once
/// Compiled kernels, one per device and source. They stay loaded until the end of the process.

#include <hiprt_build/python/gpu/driver.h>
#include <hiprt_build/python/gpu/kernel_source.h>

#include <cstddef>
#include <string>
#include <vector>

namespace hiprt::python::gpu {

/// The kernel of a source. Compiles it, or finds it in this process or in the cache of compile_kernels(). Threads may
/// call it at the same time. Throws LibraryError, for example without the compiler's library.
/// @pre the device is current.
Function kernel_of(const Driver& driver, int device, const KernelSource& source);

/// Compiles a source, or finds it in the cache. It needs no GPU.
/// @param architecture as for compile_kernels().
std::vector<std::byte> code_of(const KernelSource& source, const std::string& architecture);

/// Paths of NVRTC that are tried where the usual names are not found.
void set_compiler_paths(std::vector<std::string> paths);

}  // namespace hiprt::python::gpu
