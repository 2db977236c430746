#pragma once
/// Memory of a GPU, with the event after which it may be read.

#include <hiprt_build/python/gpu/driver.h>

#include <cstddef>
#include <memory>

namespace hiprt::python::gpu {

/// A device of a driver.
struct Device {
  const Driver* driver;
  int number;
};

/// Waits for all work of the device before it frees its memory.
class Memory {
 public:
  /// Throws LibraryError. @param bytes 0: nothing is allocated.
  Memory(Device device, std::size_t bytes);
  ~Memory();
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;

  std::byte* data() const { return static_cast<std::byte*>(data_); }
  Device device() const { return device_; }

 private:
  Device device_;
  void* data_ = nullptr;
};

/// A point in a stream.
class StreamPoint {
 public:
  /// Behind the work that is in the stream now.
  StreamPoint(Device device, Stream stream);
  ~StreamPoint();
  StreamPoint(const StreamPoint&) = delete;
  StreamPoint& operator=(const StreamPoint&) = delete;

  bool is_done() const;
  /// Lets later work of another stream wait for this point.
  void let_wait(Stream stream) const;
  /// Waits on the host.
  void synchronize() const;

 private:
  Device device_;
  Event event_ = nullptr;
};

}  // namespace hiprt::python::gpu
