/// run_time_compile ROOT KERNEL...: compiles source files of kernels with a run-time compiler, without a shim. The only
/// options are the language, the architecture and the folders of the headers. In the quick set the compiler also
/// decides what to inline. It needs no GPU.
///
/// HIPRT_NVRTC: by NVRTC; otherwise by hipRTC. Exit status: 0, or 1 (a file failed; its log is printed).

#if HIPRT_NVRTC
#include <nvrtc.h>
#define HIPRT_RTC(name) nvrtc##name
#define HIPRT_RTC_SUCCESS NVRTC_SUCCESS
#else
#include <hip/hiprtc.h>
#define HIPRT_RTC(name) hiprtc##name
#define HIPRT_RTC_SUCCESS HIPRTC_SUCCESS
#endif

#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace {

/// @return whether it compiled.
bool compile(const std::string& root, const char* path) {
  std::ostringstream source;
  source << std::ifstream(path).rdbuf();
  // Sources for hipcc name the runtime's header; run-time compilers have its contents built in.
  const char* header_names[] = {"hip/hip_runtime.h"};
  const char* headers[] = {"#pragma once\n"};
  HIPRT_RTC(Program) program;
  if (HIPRT_RTC(CreateProgram)(&program, source.str().c_str(), path, 1, headers, header_names) != HIPRT_RTC_SUCCESS)
    return false;
  const std::string include = "-I" + root, names = include + "/hiprt_device/compat";
  std::vector<const char*> options = {"-std=c++20", include.c_str(), names.c_str()};
#if HIPRT_NVRTC && defined(HIPRT_QUICK_TESTS)
  // PTX. ptxas assembles the same kernels in the test headers_nvcc.
  options.push_back("-arch=compute_90");
#elif HIPRT_NVRTC
  options.push_back("-arch=sm_90");
#else
  options.push_back("--offload-arch=gfx1030");
#endif
#ifdef HIPRT_QUICK_TESTS
  // Traversals compile in less time.
  options.push_back("-DHIPRT_LEAVE_INLINING");
#endif
  const auto result = HIPRT_RTC(CompileProgram)(program, static_cast<int>(options.size()), options.data());
  if (result != HIPRT_RTC_SUCCESS) {
    std::size_t size = 0;
    HIPRT_RTC(GetProgramLogSize)(program, &size);
    std::string log(size, '\0');
    HIPRT_RTC(GetProgramLog)(program, log.data());
    std::printf("FAILED: %s: %s\n%s\n", path, HIPRT_RTC(GetErrorString)(result), log.c_str());
  }
  HIPRT_RTC(DestroyProgram)(&program);
  return result == HIPRT_RTC_SUCCESS;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: run_time_compile ROOT KERNEL...\n");
    return 2;
  }
  int faults = 0;
  for (int i = 2; i < argc; ++i) faults += compile(argv[1], argv[i]) ? 0 : 1;
  std::printf("%d kernels compiled at run time, %d faults\n", argc - 2, faults);
  return faults == 0 ? 0 : 1;
}
