#pragma once
/// A BVH file in memory, for Python.

#include <hiprt_build/buffer.h>
#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/host/host_part.h>
#include <hiprt_build/python/gpu/scene_copies.h>
#include <hiprt_build/python/watch.h>

#include <nanobind/nanobind.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>

namespace hiprt::python {

/// A file, and what the host has prepared of it. It does not change.
class SceneData : public std::enable_shared_from_this<SceneData> {
 public:
  /// @param buffer open_buffer() accepts it.
  explicit SceneData(build::Buffer buffer, const std::optional<build::BuildStatistics>& statistics = {});

  const BufferView& view() const { return view_; }
  std::span<const std::byte> bytes() const { return view_.bytes; }
  const std::optional<build::BuildStatistics>& statistics() const { return statistics_; }
  /// The view for a query. To prepare a triangle for the host takes about as long as a ray gains by it. So that is done
  /// when there have been as many rays as triangles. If the watch is stopped meanwhile, the scene is not prepared.
  SceneView view_for(std::uint64_t rays, const Watch& watch) const;
  /// The view for kernels, which reads a copy on the device.
  SceneView on_gpu(gpu::Device device, gpu::Stream stream) const { return copies_.on(view_, device, stream); }

 private:
  void prepare(const Watch& watch) const;

  build::Buffer buffer_;
  BufferView view_;
  HostPart host_;
  gpu::SceneCopies copies_;
  std::optional<build::BuildStatistics> statistics_;
  mutable std::atomic<std::uint64_t> rays_{0};
  mutable std::atomic<bool> prepared_{false};
};

/// The Python object. refit() replaces its data; queries that run go on with what they have.
class Scene {
 public:
  explicit Scene(std::shared_ptr<const SceneData> data) : data_(std::move(data)) {}
  Scene(Scene&& other) noexcept : data_(std::move(other.data_)) {}

  std::shared_ptr<const SceneData> data() const {
    const std::lock_guard lock(mutex_);
    return data_;
  }
  void replace(std::shared_ptr<const SceneData> data) {
    const std::lock_guard lock(mutex_);
    data_ = std::move(data);
  }

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const SceneData> data_;
};

/// Adds Scene to the module.
void add_scene(nanobind::module_& module);

}  // namespace hiprt::python
