#pragma once
/// Compiles kernels at run time, by NVRTC or hipRTC. Link hiprt::rtc.
///
///     const std::vector<std::string> names{"trace<Tracer>"};
///     const auto kernels = hiprt::gpu::compile_kernels(source, names, {.architecture = "sm_90"});
///     if (!kernels) std::cerr << kernels.error().message;
///     cuModuleLoadData(&module, kernels->code.data());  // hipModuleLoadData
///     cuModuleGetFunction(&function, module, kernels->names[0].c_str());
///
/// It needs no GPU and no file of hiprt: the library holds the headers of hiprt_device. It loads the compiler's library
/// when it is first needed, so the program does not link it.

#include <hiprt_build/error.h>

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hiprt::gpu {

/// A header of the program, which its kernels include by name.
struct SourceHeader {
  std::string name, text;
};

struct CompileOptions {
  /// "gfx1030" and other processors of AMD: hipRTC makes a code object. "sm_90": NVRTC makes a cubin. "compute_90":
  /// NVRTC makes PTX.
  std::string architecture;
  std::vector<std::string> flags{};  ///< More options of the compiler, such as "-DX=1". The language is C++20.
  /// Besides those of hiprt_device. hip/hip_runtime.h is there too, and empty: both compilers know its content.
  std::vector<SourceHeader> headers{};
  /// LLVM bitcode of AMD that is linked to the source before both are optimised. hipcc -fgpu-rdc -emit-llvm -c makes
  /// it, with --offload-device-only, or with --gpu-bundle-output for several processors. That clang must not be newer.
  std::span<const std::byte> bitcode{};
  std::string file = "kernels.hip";  ///< Name of the source in the compiler's messages.
  bool cached = true;                ///< Whether to keep compiled kernels in a folder, and to look there first.
  /// That folder. It may be deleted at any time. Empty: hiprt/kernels below $XDG_CACHE_HOME or ~/.cache.
  std::string cache{};
  /// The compiler's library. Empty: the usual names of libnvrtc, or of libhiprtc and libamdhip64.
  std::string library{};
};

struct CompiledKernels {
  std::vector<std::byte> code;     ///< For cuModuleLoadData() or hipModuleLoadData(). PTX ends with a zero.
  std::vector<std::string> names;  ///< For cuModuleGetFunction() or hipModuleGetFunction().
  std::string log;                 ///< Warnings of the compiler.
  bool from_cache = false;
};

/// Compiles kernels, or finds them in the cache. What is found there was made by the same compiler from the same
/// source, names, headers, flags and architecture. Processes and threads may share the folder: its files are complete
/// or not there. A folder that cannot be read or written is no error.
///
/// hipRTC 5.2.3 (Debian 12) ends the program where it cannot compile for an architecture (gfx1100). It finds template
/// arguments by their full names only. So give hiprt's policies, which are in an inline namespace, a name of your own:
/// struct Tracer : hiprt::Policies {}.
/// @param names of the kernels that are templates, as C++ writes them: "trace<float>". Kernels that are extern "C"
///        need no name here.
/// @return kInvalidInput with the compiler's messages, or for an architecture or name that is none; kBackend without
///         the compiler's library.
build::Result<CompiledKernels> compile_kernels(std::string_view source, std::span<const std::string> names,
                                               const CompileOptions& options);

}  // namespace hiprt::gpu
