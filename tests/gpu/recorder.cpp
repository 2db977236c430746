#include <tests/gpu/recorder.h>

#include <stdexcept>
#include <utility>

namespace hiprt::checks {

namespace {

bool recording = false;
std::vector<Call> calls;
std::string failing;
hipError_t failure = hipSuccess;

/// @return whether the call is to be made.
bool note(const char* name, hipStream_t stream) {
  if (recording) calls.push_back({name, stream});
  return failing != name;
}

hipError_t failed() {
  failing.clear();
  return failure;
}

}  // namespace

void start_recording() {
  calls.clear();
  recording = true;
}

std::vector<Call> taken() {
  recording = false;
  return std::exchange(calls, {});
}

void fail_next(const char* name, hipError_t status) {
  failing = name;
  failure = status;
}

Stream::Stream() {
  if (hipStreamCreateWithFlags(&stream_, hipStreamNonBlocking) != hipSuccess)
    throw std::runtime_error("hipStreamCreateWithFlags failed");
}

}  // namespace hiprt::checks

// The names that the linker's --wrap gives.
#if defined(__HIP_PLATFORM_NVIDIA__)
#define HIPRT_REAL(name) __real_cuda##name
#define HIPRT_WRAP(name) __wrap_cuda##name
#else
#define HIPRT_REAL(name) __real_hip##name
#define HIPRT_WRAP(name) __wrap_hip##name
#endif
#define HIPRT_RECORDED(name, stream, parameters, arguments)                  \
  extern "C" hipError_t HIPRT_REAL(name) parameters;                         \
  extern "C" hipError_t HIPRT_WRAP(name) parameters {                        \
    if (!hiprt::checks::note(#name, stream)) return hiprt::checks::failed(); \
    return HIPRT_REAL(name) arguments;                                       \
  }

// clang-format off
// NOLINTBEGIN(bugprone-reserved-identifier)
HIPRT_RECORDED(MemcpyAsync, stream,
               (void* to, const void* from, size_t bytes, hipMemcpyKind kind, hipStream_t stream),
               (to, from, bytes, kind, stream))
HIPRT_RECORDED(MemsetAsync, stream, (void* to, int value, size_t bytes, hipStream_t stream), (to, value, bytes, stream))
HIPRT_RECORDED(MallocAsync, stream, (void** pointer, size_t bytes, hipStream_t stream), (pointer, bytes, stream))
HIPRT_RECORDED(FreeAsync, stream, (void* pointer, hipStream_t stream), (pointer, stream))
HIPRT_RECORDED(LaunchKernel, stream,
               (const void* kernel, dim3 grid, dim3 block, void** arguments, size_t shared, hipStream_t stream),
               (kernel, grid, block, arguments, shared, stream))
HIPRT_RECORDED(EventRecord, stream, (hipEvent_t event, hipStream_t stream), (event, stream))
HIPRT_RECORDED(StreamSynchronize, stream, (hipStream_t stream), (stream))
HIPRT_RECORDED(Memcpy, hiprt::checks::kNoStream, (void* to, const void* from, size_t bytes, hipMemcpyKind kind),
               (to, from, bytes, kind))
HIPRT_RECORDED(Memset, hiprt::checks::kNoStream, (void* to, int value, size_t bytes), (to, value, bytes))
HIPRT_RECORDED(DeviceSynchronize, hiprt::checks::kNoStream, (), ())
HIPRT_RECORDED(SetDevice, hiprt::checks::kNoStream, (int device), (device))
// NOLINTEND(bugprone-reserved-identifier)
// clang-format on
