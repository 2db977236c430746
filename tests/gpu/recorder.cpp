#include <tests/gpu/recorder.h>

#include <stdexcept>
#include <utility>

namespace hiprt::checks {

namespace {

bool recording = false;
std::vector<Call> calls;
std::string failing;
hipError_t failure = hipSuccess;

bool counting = false;
unsigned counted = 0, chosen = 0;
hipError_t chosen_failure = hipSuccess;

/// @return whether this is the call that fail_call() chose. Calls that give memory back do not fail.
bool is_chosen(const std::string& name) {
  if (!counting || name == "FreeAsync" || ++counted != chosen) return false;
  failing = name;
  failure = name == "Malloc" || name == "MallocAsync" ? hipErrorOutOfMemory : chosen_failure;
  return true;
}

/// @return whether the call is to be made.
bool note(const char* name, hipStream_t stream) {
  // hipMalloc has no stream, and hiprt may call it.
  if (recording && std::string(name) != "Malloc") calls.push_back({name, stream});
  return !is_chosen(name) && failing != name;
}

/// note() for a question to the runtime, which has no stream and is not recorded.
bool note_question(const char* name) { return !is_chosen(name) && failing != name; }

/// What the runtime would remember of the call that failed: libraries (rocPRIM) look at it alone.
hipError_t remembered = hipSuccess;

hipError_t failed() {
  failing.clear();
  remembered = failure;
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

void fail_call(unsigned number, hipError_t status) {
  counting = true;
  counted = 0;
  chosen = number;
  chosen_failure = status;
}

unsigned calls_that_may_fail() {
  counting = false;
  return counted;
}

Stream::Stream() {
  if (hipStreamCreateWithFlags(&stream_, hipStreamNonBlocking) != hipSuccess)
    throw std::runtime_error("hipStreamCreateWithFlags failed");
}

}  // namespace hiprt::checks

/// @return the remembered failure, or else what the runtime remembers.
#define HIPRT_REMEMBERED(name, forget)                             \
  extern "C" hipError_t HIPRT_REAL(name)();                        \
  extern "C" hipError_t HIPRT_WRAP(name)() {                       \
    const hipError_t injected = hiprt::checks::remembered;         \
    if (forget) hiprt::checks::remembered = hipSuccess;            \
    return injected != hipSuccess ? injected : HIPRT_REAL(name)(); \
  }

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

#define HIPRT_ASKED(name, parameters, arguments)                              \
  extern "C" hipError_t HIPRT_REAL(name) parameters;                          \
  extern "C" hipError_t HIPRT_WRAP(name) parameters {                         \
    if (!hiprt::checks::note_question(#name)) return hiprt::checks::failed(); \
    return HIPRT_REAL(name) arguments;                                        \
  }

// clang-format off
// NOLINTBEGIN(clang-diagnostic-reserved-identifier)
HIPRT_RECORDED(MemcpyAsync, stream,
               (void* to, const void* from, size_t bytes, hipMemcpyKind kind, hipStream_t stream),
               (to, from, bytes, kind, stream))
HIPRT_RECORDED(MemsetAsync, stream, (void* to, int value, size_t bytes, hipStream_t stream), (to, value, bytes, stream))
HIPRT_RECORDED(Malloc, hiprt::checks::kNoStream, (void** pointer, size_t bytes), (pointer, bytes))
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
HIPRT_RECORDED(MemcpyPeerAsync, stream,
               (void* to, int to_device, const void* from, int from_device, size_t bytes, hipStream_t stream),
               (to, to_device, from, from_device, bytes, stream))
HIPRT_ASKED(GetDevice, (int* device), (device))
HIPRT_ASKED(GetDeviceCount, (int* count), (count))
HIPRT_ASKED(DeviceGetAttribute, (int* value, hipDeviceAttribute_t attribute, int device), (value, attribute, device))
HIPRT_ASKED(MemGetInfo, (size_t* free_bytes, size_t* total_bytes), (free_bytes, total_bytes))
HIPRT_ASKED(EventCreate, (hipEvent_t* event), (event))
HIPRT_ASKED(EventSynchronize, (hipEvent_t event), (event))
HIPRT_ASKED(EventElapsedTime, (float* milliseconds, hipEvent_t start, hipEvent_t stop), (milliseconds, start, stop))
HIPRT_REMEMBERED(GetLastError, true)
HIPRT_REMEMBERED(PeekAtLastError, false)
// NOLINTEND(clang-diagnostic-reserved-identifier)
// clang-format on
