#include <hiprt_build/python/errors.h>
#include <hiprt_build/python/gpu/driver.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <mutex>
#include <span>
#include <string_view>
#include <utility>

namespace hiprt::python::gpu {
namespace {

constexpr const char* kCudaNames[] = {"libcuda.so.1"};
constexpr const char* kHipNames[] = {"libamdhip64.so.7", "libamdhip64.so.6", "libamdhip64.so.5", "libamdhip64.so",
                                     "/opt/rocm/lib/libamdhip64.so"};

[[noreturn]] void fail(build::ErrorCode code, std::string message) { throw LibraryError({code, std::move(message)}); }

std::span<const char* const> names_of(Platform platform) {
  if (platform == Platform::kCuda) return kCudaNames;
  return kHipNames;
}

/// The name that begins with "gfx" in a record of properties, whose layout differs between versions of HIP. Features
/// follow it: "gfx90a:sramecc+:xnack-".
std::string find_architecture(std::string_view record) {
  const std::size_t begin = record.find("gfx");
  if (begin == std::string_view::npos) return {};
  std::size_t end = begin + 3;
  while (end < record.size() && std::isalnum(static_cast<unsigned char>(record[end])) != 0) ++end;
  return std::string(record.substr(begin, end - begin));
}

}  // namespace

const char* name_of(Platform platform) { return platform == Platform::kCuda ? "CUDA" : "HIP"; }

const Driver& Driver::of(Platform platform) {
  if (platform == Platform::kCuda) {
    static const Driver cuda(platform);
    return cuda.checked();
  }
  static const Driver hip(platform);
  return hip.checked();
}

const Driver& Driver::checked() const {
  const std::string name = name_of(platform_);
  if (!library_.missing().empty()) fail(build::ErrorCode::kNoDevice, "no " + name + " driver: " + library_.missing());
  if (devices_ == 0) fail(build::ErrorCode::kNoDevice, "the " + name + " driver finds no GPU");
  return *this;
}

Driver::Driver(Platform platform) : platform_(platform), library_(names_of(platform)) {
  platform == Platform::kCuda ? find_cuda() : find_hip();
  find_common();
  if (!library_.missing().empty() || count_ == nullptr) return;
  const bool ready = initialize_ == nullptr || initialize_(0) == 0;
  if (!ready || count_(&devices_) != 0) devices_ = 0;
}

void Driver::find_cuda() {
  library_.find("cuInit", initialize_);
  library_.find("cuDevicePrimaryCtxRetain", retain_);
  library_.find("cuCtxPushCurrent_v2", push_);
  library_.find("cuCtxPopCurrent_v2", pop_);
  library_.find("cuDeviceGetAttribute", attribute_);
  library_.find("cuGetErrorName", cuda_error_);
  library_.find("cuPointerGetAttribute", memory_attribute_);
}

void Driver::find_hip() {
  library_.find("hipSetDevice", set_device_);
  library_.find("hipGetDevice", get_device_);
  library_.look_for("hipGetDevicePropertiesR0600", properties_);  // From HIP 6 on.
  if (properties_ == nullptr) library_.find("hipGetDeviceProperties", properties_);
  library_.find("hipGetErrorName", hip_error_);
  library_.look_for("hipPointerGetAttribute", memory_attribute_);  // From HIP 5.3 on.
}

void Driver::find_common() {
  const auto find = [this](const char* cuda, const char* hip, auto& function) {
    library_.find(platform_ == Platform::kCuda ? cuda : hip, function);
  };
  find("cuDeviceGetCount", "hipGetDeviceCount", count_);
  find("cuMemAlloc_v2", "hipMalloc", allocate_);
  find("cuMemFree_v2", "hipFree", free_);
  find("cuMemcpyHtoDAsync_v2", "hipMemcpyHtoDAsync", upload_);
  find("cuStreamCreate", "hipStreamCreateWithFlags", make_stream_);
  find("cuStreamSynchronize", "hipStreamSynchronize", wait_for_stream_);
  find("cuCtxSynchronize", "hipDeviceSynchronize", wait_for_device_);
  find("cuEventCreate", "hipEventCreateWithFlags", make_event_);
  find("cuEventDestroy_v2", "hipEventDestroy", destroy_event_);
  find("cuEventRecord", "hipEventRecord", record_);
  find("cuEventQuery", "hipEventQuery", is_done_);
  find("cuEventSynchronize", "hipEventSynchronize", wait_for_event_);
  find("cuStreamWaitEvent", "hipStreamWaitEvent", wait_);
  find("cuModuleLoadData", "hipModuleLoadData", load_);
  find("cuModuleGetFunction", "hipModuleGetFunction", function_);
  find("cuLaunchKernel", "hipModuleLaunchKernel", launch_);
}

std::string Driver::text_of(Status status) const {
  const char* text = nullptr;
  if (platform_ == Platform::kHip)
    text = hip_error_(status);
  else if (cuda_error_(status, &text) != 0)
    text = nullptr;
  return text != nullptr ? text : "error " + std::to_string(status);
}

void Driver::check(Status status, const char* call) const {
  if (status == 0) return;
  constexpr Status kOutOfMemory = 2;
  fail(status == kOutOfMemory ? build::ErrorCode::kOutOfMemory : build::ErrorCode::kGpu,
       std::string(name_of(platform_)) + ": " + call + ": " + text_of(status));
}

std::string Driver::architecture(int device) const {
  if (platform_ == Platform::kCuda) {
    constexpr int kMajor = 75, kMinor = 76;
    int major = 0, minor = 0;
    check(attribute_(&major, kMajor, device), "get attribute");
    check(attribute_(&minor, kMinor, device), "get attribute");
    return "sm_" + std::to_string(major) + std::to_string(minor);
  }
  std::array<char, 16384> record{};
  check(properties_(record.data(), device), "get properties");
  std::string found = find_architecture({record.data(), record.size()});
  if (found.empty()) fail(build::ErrorCode::kGpu, "HIP: device " + std::to_string(device) + " names no architecture");
  return found;
}

int Driver::device_of(const void* memory) const {
  constexpr int kOrdinal = 9;
  if (memory_attribute_ == nullptr)
    fail(build::ErrorCode::kGpu, "this version of HIP cannot say which device has a memory: share it by DLPack");
  int device = -1;
  check(memory_attribute_(&device, kOrdinal, reinterpret_cast<std::uintptr_t>(memory)), "find the memory's device");
  return device;
}

void* Driver::allocate(std::size_t bytes) const {
  void* memory = nullptr;
  const Status status = allocate_(&memory, bytes);
  check(status, ("allocate " + std::to_string(bytes) + " bytes").c_str());
  return memory;
}

void Driver::free(void* memory) const noexcept {
  static_cast<void>(wait_for_device_());
  static_cast<void>(free_(memory));
}

void Driver::upload(void* to, const void* from, std::size_t bytes, Stream stream) const {
  check(upload_(to, from, bytes, stream), "copy to the device");
  check(wait_for_stream_(stream), "wait for a copy to the device");
}

Stream Driver::make_stream() const {
  constexpr unsigned kNonBlocking = 1;
  Stream stream = nullptr;
  check(make_stream_(&stream, kNonBlocking), "make a stream");
  return stream;
}

Event Driver::make_event() const {
  constexpr unsigned kWithoutTimes = 2;
  Event event = nullptr;
  check(make_event_(&event, kWithoutTimes), "make an event");
  return event;
}

void Driver::destroy(Event event) const noexcept { static_cast<void>(destroy_event_(event)); }

void Driver::record(Event event, Stream stream) const { check(record_(event, stream), "record an event"); }

bool Driver::is_done(Event event) const {
  const Status not_ready = 600;  // CUDA_ERROR_NOT_READY and hipErrorNotReady.
  const Status status = is_done_(event);
  if (status == not_ready) return false;
  check(status, "query an event");
  return true;
}

void Driver::wait(Stream stream, Event event) const { check(wait_(stream, event, 0), "wait for an event"); }

void Driver::synchronize(Event event) const { check(wait_for_event_(event), "wait for an event"); }

Function Driver::load(const void* code, const char* kernel) const {
  void* module = nullptr;
  Function function = nullptr;
  check(load_(&module, code), "load a module");
  check(function_(&function, module, kernel), "find a kernel");
  return function;
}

void Driver::launch(Function function, unsigned blocks, unsigned threads, Stream stream, void** arguments) const {
  check(launch_(function, blocks, 1, 1, threads, 1, 1, 0, stream, arguments, nullptr), "launch a kernel");
}

CurrentDevice::CurrentDevice(const Driver& driver, int device) : driver_(driver) {
  if (device < 0 || device >= driver.devices_)
    fail(build::ErrorCode::kNoDevice, std::string(name_of(driver.platform_)) + " has no device " +
                                          std::to_string(device) + ", but " + std::to_string(driver.devices_) +
                                          " devices");
  if (driver.platform_ == Platform::kHip) {
    driver.check(driver.get_device_(&previous_), "get the device");
    driver.check(driver.set_device_(device), "set the device");
    return;
  }
  // Primary contexts are retained once per process.
  static std::mutex mutex;
  static std::map<int, void*> contexts;
  const std::lock_guard lock(mutex);
  void*& context = contexts[device];
  if (context == nullptr) driver.check(driver.retain_(&context, device), "retain the primary context");
  driver.check(driver.push_(context), "make a context current");
}

CurrentDevice::~CurrentDevice() {
  void* popped = nullptr;
  if (driver_.platform_ == Platform::kHip)
    static_cast<void>(driver_.set_device_(previous_));
  else
    static_cast<void>(driver_.pop_(&popped));
}

}  // namespace hiprt::python::gpu
