#pragma once
/// NVRTC or hipRTC, loaded from its library. Their interfaces differ in names only. Internal.

#include <hiprt_build/gpu/compile.h>
#include <hiprt_build/rtc/shared_library.h>

#include <memory>
#include <mutex>
#include <string>

namespace hiprt::gpu::rtc {

enum class CompilerKind { kNvrtc, kHiprtc };

class Compiler {
 public:
  /// Loads the library once per process and keeps it.
  /// @param library path or name; empty: the usual names.
  /// @return kBackend with the names that were tried.
  static build::Result<Compiler*> load(CompilerKind kind, const std::string& library);

  /// Without the cache. Threads may call it at the same time.
  build::Result<CompiledKernels> compile(const std::string& source, std::span<const std::string> names,
                                         const CompileOptions& options);

  /// Differs between any two compilers: version, and path, size and time of the library.
  const std::string& identity() const { return identity_; }

 private:
  /// An opaque handle: nvrtcProgram or hiprtcProgram. Results are enumerations with 0 for success.
  using Program = void*;
  class OwnedProgram;

  explicit Compiler(CompilerKind kind) : kind_(kind) {}
  void find_functions(SharedLibrary& library);
  std::string describe_library() const;
  std::vector<std::string> flags_of(const CompileOptions& options) const;
  std::string log_of(Program program) const;
  build::Result<CompiledKernels> result_of(Program program, std::span<const std::string> names,
                                           const CompileOptions& options) const;
  tl::unexpected<build::Error> failed(const char* what, int result) const;

  CompilerKind kind_;
  std::string identity_;
  std::mutex mutex_;  ///< hipRTC is not safe in threads.

  const char* (*error_string_)(int) = nullptr;
  int (*version_)(int*, int*) = nullptr;
  int (*create_)(Program*, const char*, const char*, int, const char* const*, const char* const*) = nullptr;
  int (*destroy_)(Program*) = nullptr;
  int (*add_name_)(Program, const char*) = nullptr;
  int (*compile_)(Program, int, const char* const*) = nullptr;
  int (*log_size_)(Program, std::size_t*) = nullptr;
  int (*log_)(Program, char*) = nullptr;
  int (*lowered_name_)(Program, const char*, const char**) = nullptr;
  /// Of the machine code, and of PTX (NVRTC only).
  int (*code_size_)(Program, std::size_t*) = nullptr;
  int (*code_)(Program, char*) = nullptr;
  int (*ptx_size_)(Program, std::size_t*) = nullptr;
  int (*ptx_)(Program, char*) = nullptr;
};

}  // namespace hiprt::gpu::rtc
