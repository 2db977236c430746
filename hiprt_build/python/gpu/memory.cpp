#include <hiprt_build/python/gpu/memory.h>

#include <hiprt_build/python/errors.h>

#include <optional>

namespace hiprt::python::gpu {

Memory::Memory(Device device, std::size_t bytes) : device_(device) {
  if (bytes == 0) return;
  const CurrentDevice current(*device.driver, device.number);
  data_ = device.driver->allocate(bytes);
}

Memory::~Memory() {
  if (data_ == nullptr) return;
  // Work that is waited for may need the GIL: a callback of the program in the stream.
  std::optional<nanobind::gil_scoped_release> without_gil;
  if (Py_IsInitialized() != 0 && PyGILState_Check() != 0) without_gil.emplace();
  try {
    const CurrentDevice current(*device_.driver, device_.number);
    device_.driver->free(data_);
  } catch (const LibraryError&) {
    // At the end of the process the driver may be gone, and its memory with it.
    data_ = nullptr;
  }
}

StreamPoint::StreamPoint(Device device, Stream stream) : device_(device) {
  const CurrentDevice current(*device.driver, device.number);
  event_ = device.driver->make_event();
  try {
    device.driver->record(event_, stream);
  } catch (const LibraryError&) {
    device.driver->destroy(event_);
    throw;
  }
}

StreamPoint::~StreamPoint() { device_.driver->destroy(event_); }

bool StreamPoint::is_done() const {
  const CurrentDevice current(*device_.driver, device_.number);
  return device_.driver->is_done(event_);
}

void StreamPoint::let_wait(Stream stream) const {
  const CurrentDevice current(*device_.driver, device_.number);
  device_.driver->wait(stream, event_);
}

void StreamPoint::synchronize() const {
  const CurrentDevice current(*device_.driver, device_.number);
  device_.driver->synchronize(event_);
}

}  // namespace hiprt::python::gpu
