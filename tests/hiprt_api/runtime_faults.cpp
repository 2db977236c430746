#include <tests/hiprt_api/runtime_faults.h>

#include <hip/hip_runtime_api.h>

#include <dlfcn.h>

namespace hiprt_api_test {
namespace {

bool counting = false;
unsigned counted = 0, chosen = 0;
Held now{};

/// What the runtime would remember of the call that failed: rocPRIM looks at it alone.
hipError_t remembered = hipSuccess;

bool fails(hipError_t failure) {
  if (!counting || ++counted != chosen) return false;
  remembered = failure;
  return true;
}

template <class Function> Function real(const char* name) { return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name)); }

}  // namespace

void fail_call(unsigned number) {
  counting = true;
  counted = 0;
  chosen = number;
}

unsigned calls_that_may_fail() {
  counting = false;
  return counted;
}

Held held() { return now; }

}  // namespace hiprt_api_test

// clang-format off
/// @param status of a call that fails. @param change what a call that succeeds changes.
#define HIPRT_BEFORE(name, parameters, arguments, may_fail, failure, change)              \
  extern "C" __attribute__((visibility("default"))) hipError_t name parameters {          \
    using namespace hiprt_api_test;                                                       \
    using Function = hipError_t (*) parameters;                                           \
    static const auto function = real<Function>(#name);                                   \
    if (may_fail && fails(failure)) return failure;                                              \
    const hipError_t status = function arguments;                                         \
    if (status == hipSuccess) change;                                                     \
    return status;                                                                        \
  }
#define HIPRT_FALLIBLE(name, parameters, arguments) \
  HIPRT_BEFORE(name, parameters, arguments, true, hipErrorUnknown, (void)0)

HIPRT_BEFORE(hipMalloc, (void** pointer, size_t bytes), (pointer, bytes), true, hipErrorOutOfMemory, ++now.device)
HIPRT_BEFORE(hipMallocAsync, (void** pointer, size_t bytes, hipStream_t stream), (pointer, bytes, stream), true,
             hipErrorOutOfMemory, ++now.device)
HIPRT_BEFORE(hipFree, (void* pointer), (pointer), false, hipSuccess, now.device -= pointer != nullptr ? 1 : 0)
HIPRT_BEFORE(hipFreeAsync, (void* pointer, hipStream_t stream), (pointer, stream), false, hipSuccess,
             now.device -= pointer != nullptr ? 1 : 0)
HIPRT_BEFORE(hipHostMalloc, (void** pointer, size_t bytes, unsigned flags), (pointer, bytes, flags), true,
             hipErrorOutOfMemory, ++now.host)
HIPRT_BEFORE(hipHostFree, (void* pointer), (pointer), false, hipSuccess, now.host -= pointer != nullptr ? 1 : 0)
HIPRT_BEFORE(hipEventCreate, (hipEvent_t* event), (event), true, hipErrorUnknown, ++now.events)
HIPRT_BEFORE(hipEventDestroy, (hipEvent_t event), (event), false, hipSuccess, --now.events)
HIPRT_FALLIBLE(hipGetDevice, (int* device), (device))
HIPRT_FALLIBLE(hipSetDevice, (int device), (device))
HIPRT_FALLIBLE(hipGetDeviceCount, (int* count), (count))
HIPRT_FALLIBLE(hipDeviceGetAttribute, (int* value, hipDeviceAttribute_t attribute, int device),
               (value, attribute, device))
HIPRT_FALLIBLE(hipMemGetInfo, (size_t* free_bytes, size_t* total_bytes), (free_bytes, total_bytes))
HIPRT_FALLIBLE(hipEventRecord, (hipEvent_t event, hipStream_t stream), (event, stream))
HIPRT_FALLIBLE(hipEventSynchronize, (hipEvent_t event), (event))
HIPRT_FALLIBLE(hipMemcpy, (void* to, const void* from, size_t bytes, hipMemcpyKind kind), (to, from, bytes, kind))
HIPRT_FALLIBLE(hipMemcpyAsync, (void* to, const void* from, size_t bytes, hipMemcpyKind kind, hipStream_t stream),
               (to, from, bytes, kind, stream))
HIPRT_FALLIBLE(hipMemset, (void* to, int value, size_t bytes), (to, value, bytes))
HIPRT_FALLIBLE(hipMemsetAsync, (void* to, int value, size_t bytes, hipStream_t stream), (to, value, bytes, stream))
HIPRT_FALLIBLE(hipStreamSynchronize, (hipStream_t stream), (stream))
HIPRT_FALLIBLE(hipDeviceSynchronize, (), ())
HIPRT_FALLIBLE(hipLaunchKernel,
               (const void* kernel, dim3 grid, dim3 block, void** arguments, size_t shared, hipStream_t stream),
               (kernel, grid, block, arguments, shared, stream))

/// @return the remembered failure, or else what the runtime remembers.
#define HIPRT_REMEMBERED(name, forget)                                                    \
  extern "C" __attribute__((visibility("default"))) hipError_t name() {                   \
    using namespace hiprt_api_test;                                                       \
    static const auto function = real<hipError_t (*)()>(#name);                           \
    const hipError_t injected = remembered;                                               \
    if (forget) remembered = hipSuccess;                                                  \
    return injected != hipSuccess ? injected : function();                                \
  }
HIPRT_REMEMBERED(hipGetLastError, true)
HIPRT_REMEMBERED(hipPeekAtLastError, false)
// clang-format on
