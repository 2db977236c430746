#include <hiprt_build/python/gpu/scene_copies.h>

namespace hiprt::python::gpu {

SceneView SceneCopies::on(const BufferView& file, Device device, Stream stream) const {
  const std::lock_guard lock(mutex_);
  std::unique_ptr<Memory>& copy = copies_[{device.driver->platform(), device.number}];
  if (copy == nullptr) {
    // Drivers align to 256 bytes, and files need kBufferAlignment.
    auto made = std::make_unique<Memory>(device, file.bytes.size());
    const CurrentDevice current(*device.driver, device.number);
    device.driver->upload(made->data(), file.bytes.data(), file.bytes.size(), stream);
    copy = std::move(made);
  }
  return make_scene_view(file, copy->data());
}

}  // namespace hiprt::python::gpu
