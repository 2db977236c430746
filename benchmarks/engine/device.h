#pragma once
/// Where kernels run and how they are timed: the threads of a CPU, or a GPU. bench_variants and bench_tradeoff share
/// it.

#include "kernel.h"

#include <hiprt_build/error.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/scene_view.h>

#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace hiprt::bench {

/// What a kernel uses on a multiprocessor; all zero on a CPU.
struct Resources {
  unsigned registers = 0;          ///< Per thread.
  std::uint64_t local_bytes = 0;   ///< Per thread: its stack and spilled registers.
  std::uint64_t shared_bytes = 0;  ///< Per block.
  unsigned resident_threads = 0;   ///< Per multiprocessor.
  double occupancy = 0;            ///< Resident threads relative to the largest number that a multiprocessor can hold.
};

struct Repetitions {
  unsigned warm_up = 3;  ///< Launches before the timed ones.
  unsigned timed = 15;
};

/// One run of a kernel.
struct Launch {
  Kernel kernel;
  void* job;                         ///< On the host. A GPU copies it as the kernel's argument.
  std::uint64_t count;               ///< Items of the job, at least 1.
  unsigned grid = 0;                 ///< Blocks of a GPU; 0: one thread per item.
  std::uint32_t* counter = nullptr;  ///< Device memory that is set to 0 before each launch, within the timed interval.
};

/// Bytes of a device, which must outlive them. Copies share the bytes.
class Memory {
 public:
  Memory() = default;
  Memory(std::shared_ptr<void> owner, std::byte* data, std::size_t size)
      : owner_(std::move(owner)), data_(data), size_(size) {}

  std::byte* data() const { return data_; }  ///< On the device.
  std::size_t size() const { return size_; }

 private:
  std::shared_ptr<void> owner_;
  std::byte* data_ = nullptr;
  std::size_t size_ = 0;
};

/// A BVH file that kernels can read.
struct LoadedScene {
  Memory memory;  ///< Empty on a CPU, which reads the caller's bytes.
  SceneView view;
};

class Device {
 public:
  virtual ~Device() = default;
  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  /// Kind ("cpu" or "gpu"), name and versions, for JSON.
  virtual nlohmann::json describe() const = 0;
  /// Whether the device can run kernels for AMD's ray instruction (amd_ray_test.h).
  virtual bool has_ray_instruction() const { return false; }
  virtual unsigned wave_size() const { return 1; }
  virtual unsigned compute_units() const { return 1; }

  virtual build::Result<Memory> allocate(std::size_t bytes) = 0;
  /// @pre from.size() <= to.size()
  virtual build::Result<void> write(const Memory& to, std::span<const std::byte> from) = 0;
  /// @pre to.size() <= from.size()
  virtual build::Result<void> read(const Memory& from, std::span<std::byte> to) const = 0;
  virtual build::Result<void> fill(const Memory& memory, std::byte value) = 0;
  /// @param view must outlive the result.
  virtual build::Result<LoadedScene> load(const BufferView& view) = 0;

  virtual build::Result<Resources> resources(const Kernel& kernel) const = 0;
  /// Launches the kernel warm_up + timed times. A GPU's launches are queued without waiting in between.
  /// @return milliseconds of each timed launch.
  virtual build::Result<std::vector<double>> run(const Launch& launch, const Repetitions& repetitions) = 0;
};

/// @param threads 0: as many as the machine has.
std::unique_ptr<Device> make_cpu_device(unsigned threads);
/// @return kNoDevice without a GPU, or if this program was built without GPU code.
build::Result<std::unique_ptr<Device>> make_gpu_device();

/// Items of one type in a device's memory.
template <class T> class Array {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  static build::Result<Array> make(Device& device, std::size_t count) {
    auto memory = device.allocate(sizeof(T) * count);
    if (!memory) return tl::unexpected(memory.error());
    Array array;
    array.memory_ = std::move(*memory);
    return array;
  }
  static build::Result<Array> copy(Device& device, std::span<const T> values) {
    auto array = make(device, values.size());
    if (!array) return array;
    if (auto written = device.write(array->memory_, std::as_bytes(values)); !written)
      return tl::unexpected(written.error());
    return array;
  }

  const Memory& memory() const { return memory_; }
  T* data() const { return reinterpret_cast<T*>(memory_.data()); }
  std::size_t size() const { return memory_.size() / sizeof(T); }

  build::Result<std::vector<T>> to_vector(const Device& device) const {
    std::vector<T> values(size());
    if (auto read = device.read(memory_, std::as_writable_bytes(std::span(values))); !read)
      return tl::unexpected(read.error());
    return values;
  }

 private:
  Memory memory_;
};

}  // namespace hiprt::bench
