// AMD's runtime under its own names, looked up at the first call. So the library loads on a machine without it, and
// every call fails there. The names are local to the library.
//
// Kernels are registered at the first use of one, because the runtime's own initialisation may come after this
// library's.

#include <hiprt_build/rtc/shared_library.h>

#include <hip/hip_runtime_api.h>

#include <dlfcn.h>

#include <memory>
#include <mutex>
#include <vector>

namespace {

hiprt::gpu::rtc::SharedLibrary& runtime() {
  static constexpr const char* kNames[] = {"libamdhip64.so.5", "libamdhip64.so.6", "libamdhip64.so.7", "libamdhip64.so",
                                           "/opt/rocm/lib/libamdhip64.so"};
  static hiprt::gpu::rtc::SharedLibrary library(kNames);
  return library;
}

template <class Function> Function find(const char* name) {
  auto function = reinterpret_cast<Function>(dlsym(RTLD_DEFAULT, name));
  if (function == nullptr) runtime().look_for(name, function);
  return function;
}

/// Arguments of __hipRegisterFunction().
struct Kernel {
  const void* host;
  char* device;
  const char* name;
  unsigned limit;
};

/// The code of one source, which hipcc's code wants to register when the library is loaded.
struct Module {
  const void* code;
  std::vector<Kernel> kernels{};
  void** handle = nullptr;  ///< The runtime's.
};

std::vector<std::unique_ptr<Module>>& modules() {
  static std::vector<std::unique_ptr<Module>> all;
  return all;
}

void register_kernels() {
  static std::once_flag once;
  std::call_once(once, [] {
    using RegisterCode = void** (*)(const void*);
    using RegisterKernel =
        void (*)(void**, const void*, char*, const char*, unsigned, void*, void*, void*, void*, int*);
    const auto add_code = find<RegisterCode>("__hipRegisterFatBinary");
    const auto add_kernel = find<RegisterKernel>("__hipRegisterFunction");
    if (add_code == nullptr || add_kernel == nullptr) return;
    for (const auto& module : modules()) {
      module->handle = add_code(module->code);
      for (const Kernel& kernel : module->kernels)
        add_kernel(module->handle, kernel.host, kernel.device, kernel.name, kernel.limit, nullptr, nullptr, nullptr,
                   nullptr, nullptr);
    }
  });
}

}  // namespace

// The name may be a macro of a newer HIP.
#define HIPRT_TEXT(name) #name
#define HIPRT_FORWARD_AS(Result, absent, name, parameters, arguments) \
  Result name parameters {                                            \
    using Function = Result(*) parameters;                            \
    static const auto function = find<Function>(HIPRT_TEXT(name));    \
    return function == nullptr ? absent : function arguments;         \
  }
#define HIPRT_FORWARD(name, parameters, arguments) \
  HIPRT_FORWARD_AS(hipError_t, hipErrorNoDevice, name, parameters, arguments)
/// For functions that take a kernel.
#define HIPRT_FORWARD_KERNEL(name, parameters, arguments)               \
  hipError_t name parameters {                                          \
    using Function = hipError_t(*) parameters;                          \
    static const auto function = find<Function>(HIPRT_TEXT(name));      \
    register_kernels();                                                 \
    return function == nullptr ? hipErrorNoDevice : function arguments; \
  }

extern "C" {

HIPRT_FORWARD(hipGetDeviceCount, (int* count), (count))
HIPRT_FORWARD(hipGetDevice, (int* device), (device))
HIPRT_FORWARD(hipSetDevice, (int device), (device))
HIPRT_FORWARD(hipGetDeviceProperties, (hipDeviceProp_t * properties, int device), (properties, device))
HIPRT_FORWARD(hipDeviceGetAttribute, (int* value, hipDeviceAttribute_t attribute, int device),
              (value, attribute, device))
HIPRT_FORWARD(hipDeviceSynchronize, (void), ())
HIPRT_FORWARD(hipGetLastError, (void), ())
HIPRT_FORWARD_AS(const char*, "hipErrorNoDevice", hipGetErrorName, (hipError_t error), (error))
HIPRT_FORWARD_AS(const char*, "AMD's runtime libamdhip64 is not here", hipGetErrorString, (hipError_t error), (error))

HIPRT_FORWARD(hipMalloc, (void** pointer, size_t bytes), (pointer, bytes))
HIPRT_FORWARD(hipFree, (void* pointer), (pointer))
HIPRT_FORWARD(hipHostMalloc, (void** pointer, size_t bytes, unsigned flags), (pointer, bytes, flags))
HIPRT_FORWARD(hipHostFree, (void* pointer), (pointer))
HIPRT_FORWARD(hipMallocAsync, (void** pointer, size_t bytes, hipStream_t stream), (pointer, bytes, stream))
HIPRT_FORWARD(hipFreeAsync, (void* pointer, hipStream_t stream), (pointer, stream))
HIPRT_FORWARD(hipMemGetInfo, (size_t * free_bytes, size_t* total), (free_bytes, total))
HIPRT_FORWARD(hipMemcpy, (void* to, const void* from, size_t bytes, hipMemcpyKind kind), (to, from, bytes, kind))
HIPRT_FORWARD(hipMemcpyAsync, (void* to, const void* from, size_t bytes, hipMemcpyKind kind, hipStream_t stream),
              (to, from, bytes, kind, stream))
HIPRT_FORWARD(hipMemset, (void* to, int value, size_t bytes), (to, value, bytes))
HIPRT_FORWARD(hipMemsetAsync, (void* to, int value, size_t bytes, hipStream_t stream), (to, value, bytes, stream))
HIPRT_FORWARD(hipStreamSynchronize, (hipStream_t stream), (stream))
HIPRT_FORWARD(hipEventCreate, (hipEvent_t * event), (event))
HIPRT_FORWARD(hipEventDestroy, (hipEvent_t event), (event))
HIPRT_FORWARD(hipEventQuery, (hipEvent_t event), (event))
HIPRT_FORWARD(hipEventRecord, (hipEvent_t event, hipStream_t stream), (event, stream))
HIPRT_FORWARD(hipEventSynchronize, (hipEvent_t event), (event))

HIPRT_FORWARD(hipModuleLoadData, (hipModule_t * module, const void* code), (module, code))
HIPRT_FORWARD(hipModuleGetFunction, (hipFunction_t * found, hipModule_t module, const char* name),
              (found, module, name))
HIPRT_FORWARD(hipModuleUnload, (hipModule_t module), (module))

HIPRT_FORWARD_KERNEL(hipFuncGetAttributes, (hipFuncAttributes * attributes, const void* kernel), (attributes, kernel))
HIPRT_FORWARD_KERNEL(hipOccupancyMaxActiveBlocksPerMultiprocessor,
                     (int* blocks, const void* kernel, int block, size_t bytes), (blocks, kernel, block, bytes))
HIPRT_FORWARD_KERNEL(hipOccupancyMaxPotentialBlockSize,
                     (int* grid, int* block, const void* kernel, size_t bytes, int limit),
                     (grid, block, kernel, bytes, limit))
HIPRT_FORWARD_KERNEL(hipLaunchKernel,
                     (const void* kernel, dim3 grid, dim3 block, void** arguments, size_t bytes, hipStream_t stream),
                     (kernel, grid, block, arguments, bytes, stream))

// What hipcc's code calls for kernels: some of it when the library is loaded.
HIPRT_FORWARD(__hipPushCallConfiguration, (dim3 grid, dim3 block, size_t bytes, hipStream_t stream),
              (grid, block, bytes, stream))
HIPRT_FORWARD(__hipPopCallConfiguration, (dim3 * grid, dim3* block, size_t* bytes, hipStream_t* stream),
              (grid, block, bytes, stream))

// The compiler gives the names. NOLINTBEGIN(*-reserved-identifier)
void** __hipRegisterFatBinary(const void* code) {
  modules().push_back(std::make_unique<Module>(Module{code}));
  return reinterpret_cast<void**>(modules().back().get());
}

void __hipRegisterFunction(void** module, const void* host, char* device, const char* name, unsigned limit, void*,
                           void*, void*, void*, int*) {
  reinterpret_cast<Module*>(module)->kernels.push_back({host, device, name, limit});
}

void __hipUnregisterFatBinary(void** module) {
  using Unregister = void (*)(void**);
  void** const handle = reinterpret_cast<Module*>(module)->handle;
  const auto unregister = handle != nullptr ? find<Unregister>("__hipUnregisterFatBinary") : nullptr;
  if (unregister != nullptr) unregister(handle);
}
// NOLINTEND(*-reserved-identifier)
}
