#pragma once
/// Copies of a scene's file in the memory of GPUs.

#include <hiprt_build/format/view.h>
#include <hiprt_build/python/gpu/memory.h>

#include <map>
#include <memory>
#include <mutex>
#include <utility>

namespace hiprt::python::gpu {

/// One copy per device, made at the first query there or earlier, and freed with the scene.
class SceneCopies {
 public:
  /// The view that kernels take. Waits for the copy if it is the first. Threads may call it at the same time.
  SceneView on(const BufferView& file, Device device, Stream stream) const;

 private:
  mutable std::mutex mutex_;
  mutable std::map<std::pair<Platform, int>, std::unique_ptr<Memory>> copies_;
};

}  // namespace hiprt::python::gpu
