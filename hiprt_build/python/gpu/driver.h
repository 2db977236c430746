#pragma once
/// The drivers of NVIDIA and AMD, loaded when they are first needed. Their calls differ in names only.

#include <hiprt_build/rtc/shared_library.h>

#include <cstddef>
#include <cstdint>
#include <string>

namespace hiprt::python::gpu {

enum class Platform { kCuda, kHip };

const char* name_of(Platform platform);

using Stream = void*;
using Event = void*;
using Function = void*;

/// A driver. All calls throw LibraryError, and need a current device (CurrentDevice).
class Driver {
 public:
  /// Loads it once per process. Throws LibraryError without a driver or a GPU.
  static const Driver& of(Platform platform);

  Platform platform() const { return platform_; }
  /// For compile_kernels(), such as "sm_90".
  std::string architecture(int device) const;
  /// The device that has the memory.
  int device_of(const void* memory) const;

  void* allocate(std::size_t bytes) const;
  /// Waits for all work of the current device, so that nothing uses the memory, and frees it. Never fails: at the end
  /// of a process the driver may be gone.
  void free(void* memory) const noexcept;
  /// Copies host memory, and waits for the copy.
  void upload(void* to, const void* from, std::size_t bytes, Stream stream) const;

  Stream make_stream() const;
  Event make_event() const;
  void destroy(Event event) const noexcept;
  void record(Event event, Stream stream) const;
  /// Whether the work before the event is done.
  bool is_done(Event event) const;
  /// Lets the work that follows in the stream wait for the event.
  void wait(Stream stream, Event event) const;
  void synchronize(Event event) const;

  /// @param code stays loaded until the end of the process.
  Function load(const void* code, const char* kernel) const;
  void launch(Function function, unsigned blocks, unsigned threads, Stream stream, void** arguments) const;

 private:
  friend class CurrentDevice;
  using Status = int;  ///< 0 is success.

  explicit Driver(Platform platform);
  /// Throws without a driver or a GPU.
  const Driver& checked() const;
  void find_common();
  void find_cuda();
  void find_hip();
  std::string text_of(Status status) const;
  /// @throws LibraryError if the call failed. @param call in CUDA's words.
  void check(Status status, const char* call) const;

  Platform platform_;
  hiprt::gpu::rtc::SharedLibrary library_;
  int devices_ = 0;

  // CUDA's only.
  Status (*initialize_)(unsigned) = nullptr;
  Status (*retain_)(void**, int) = nullptr;
  Status (*push_)(void*) = nullptr;
  Status (*pop_)(void**) = nullptr;
  Status (*attribute_)(int*, int, int) = nullptr;
  Status (*cuda_error_)(Status, const char**) = nullptr;
  // HIP's only.
  Status (*set_device_)(int) = nullptr;
  Status (*get_device_)(int*) = nullptr;
  Status (*properties_)(void*, int) = nullptr;
  const char* (*hip_error_)(Status) = nullptr;
  // Both have these.
  Status (*count_)(int*) = nullptr;
  Status (*memory_attribute_)(void*, int, std::uintptr_t) = nullptr;
  Status (*allocate_)(void**, std::size_t) = nullptr;
  Status (*free_)(void*) = nullptr;
  Status (*upload_)(void*, const void*, std::size_t, Stream) = nullptr;
  Status (*make_stream_)(Stream*, unsigned) = nullptr;
  Status (*wait_for_stream_)(Stream) = nullptr;
  Status (*wait_for_device_)() = nullptr;
  Status (*make_event_)(Event*, unsigned) = nullptr;
  Status (*destroy_event_)(Event) = nullptr;
  Status (*record_)(Event, Stream) = nullptr;
  Status (*is_done_)(Event) = nullptr;
  Status (*wait_for_event_)(Event) = nullptr;
  Status (*wait_)(Stream, Event, unsigned) = nullptr;
  Status (*load_)(void**, const void*) = nullptr;
  Status (*function_)(Function*, void*, const char*) = nullptr;
  Status (*launch_)(Function, unsigned, unsigned, unsigned, unsigned, unsigned, unsigned, unsigned, Stream, void**,
                    void**) = nullptr;
};

/// While it lives, the device is the thread's current one. With CUDA its primary context is, which PyTorch, CuPy and
/// JAX use too.
class CurrentDevice {
 public:
  /// Throws LibraryError if there is no such device.
  CurrentDevice(const Driver& driver, int device);
  ~CurrentDevice();
  CurrentDevice(const CurrentDevice&) = delete;
  CurrentDevice& operator=(const CurrentDevice&) = delete;

 private:
  const Driver& driver_;
  int previous_ = -1;
};

}  // namespace hiprt::python::gpu
