#pragma once
/// One scene on several GPUs: it is built or uploaded once, and copied from device to device.

#include <hiprt_build/gpu/device.h>
#include <hiprt_build/gpu/scene.h>

#include <span>
#include <vector>

namespace hiprt::gpu {

/// Makes a device the current one, and at its end the device before it.
class CurrentDevice {
 public:
  /// @return the runtime's error; kInvalidInput for an index that no device has.
  static Result<CurrentDevice> make(int index) {
    const auto devices = device_detail::count();
    if (!devices) return tl::unexpected(devices.error());
    if (index < 0 || index >= *devices)
      return fail(ErrorCode::kInvalidInput, "device ", index, ": this machine has ", *devices, ", counted from 0");
    int before = 0;
    if (auto got = check(hipGetDevice(&before), "hipGetDevice"); !got) return tl::unexpected(got.error());
    if (auto set = check(hipSetDevice(index), "hipSetDevice", "device ", index); !set)
      return tl::unexpected(set.error());
    return CurrentDevice(before);
  }

  CurrentDevice(CurrentDevice&& other) noexcept : before_(std::exchange(other.before_, kNone)) {}
  CurrentDevice& operator=(CurrentDevice&&) = delete;
  ~CurrentDevice() {
    if (before_ != kNone) error_detail::ignore(hipSetDevice(before_));
  }

 private:
  static constexpr int kNone = -1;
  explicit CurrentDevice(int before) : before_(before) {}

  int before_;
};

/// A scene on one device.
struct Replica {
  int device = 0;  ///< As hipSetDevice() takes it. Make it the current one (CurrentDevice) to launch kernels.
  DeviceScene scene;
};

namespace replicate_detail {

/// The view of a copy of the memory that @p of points into. @param shift from the memory to its copy, in bytes.
inline SceneView moved(SceneView of, std::ptrdiff_t shift) {
  const auto move = [&]<class T>(const T*& pointer) {
    if (pointer != nullptr)
      pointer = reinterpret_cast<const T*>(reinterpret_cast<std::uintptr_t>(pointer) + static_cast<std::size_t>(shift));
  };
  move(of.base);
  move(of.geometries);
  move(of.instances);
  move(of.objects);
  move(of.motions);
  return of;
}

/// @param from the device that has @p source. Waits for the copy.
inline Result<Replica> copy(const DeviceBuffer& source, const SceneView& view, int from, int to, Allocator& allocator) {
  const auto current = CurrentDevice::make(to);
  if (!current) return tl::unexpected(current.error());
  const std::size_t bytes = source.size();
  auto buffer = DeviceBuffer::make(bytes, nullptr, allocator, kBufferAlignment);
  if (!buffer) return tl::unexpected(std::move(buffer.error()));
  auto copied = from == to
                    ? check(hipMemcpyAsync(buffer->data(), source.data(), bytes, hipMemcpyDeviceToDevice, nullptr),
                            "hipMemcpyAsync", bytes, " bytes on device ", to)
                    : check(hipMemcpyPeerAsync(buffer->data(), to, source.data(), from, bytes, nullptr),
                            "hipMemcpyPeerAsync", bytes, " bytes from device ", from, " to device ", to);
  if (copied) copied = check(hipStreamSynchronize(nullptr), "hipStreamSynchronize", "device ", to);
  if (!copied) return tl::unexpected(std::move(copied.error()));
  const std::ptrdiff_t shift = static_cast<std::ptrdiff_t>(reinterpret_cast<std::uintptr_t>(buffer->data()) -
                                                           reinterpret_cast<std::uintptr_t>(source.data()));
  return Replica{to, {std::move(*buffer), moved(view, shift)}};
}

}  // namespace replicate_detail

/// Copies a scene to devices: directly where the machine lets them, else the runtime copies through the host. All work
/// that makes the scene must be done. Waits for the copies. The current device is the same afterwards.
/// @tparam Scene DeviceScene, BuiltScene, or another with a DeviceBuffer `buffer` and a SceneView `view` into it.
/// @param from the device that has the scene.
/// @param devices may contain @p from, and one device several times. Every entry gets a copy.
/// @param allocator is asked for memory while each device is the current one, as DeviceAllocator needs it.
/// @return the copies in the order of @p devices. kInvalidInput for an index that no device has; the allocator's and
/// the runtime's errors, with the device's index.
template <class Scene>
Result<std::vector<Replica>> replicate(const Scene& scene, int from, std::span<const int> devices,
                                       Allocator& allocator) {
  std::vector<Replica> replicas;
  for (const int device : devices) {
    auto replica = replicate_detail::copy(scene.buffer, scene.view, from, device, allocator);
    if (!replica) {
      replica.error().message = "replicate, device " + std::to_string(device) + ": " + replica.error().message;
      return tl::unexpected(std::move(replica.error()));
    }
    replicas.push_back(std::move(*replica));
  }
  return replicas;
}

}  // namespace hiprt::gpu
