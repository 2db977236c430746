#pragma once
/// Scenes inside of scenes. Internal.

#include <hiprt_build/hiprt_api/scene.h>

namespace hiprt::api {

/// The scenes among the objects of a scene.
struct InnerScenes {
  std::vector<InnerScene> scenes;            ///< Each once.
  std::vector<std::uint32_t> scene_of;       ///< Of instance i its number; kNone: a geometry. Empty: all are.
  std::uint32_t objects = 0, instances = 0;  ///< Sums.

  static constexpr std::uint32_t kNone = ~0u;
};

/// Whether any instance of a scene is of a scene: the build's first kernel answers it, and the host reads the answer
/// while the others run.
class InnerQuestion {
 public:
  static Result<InnerQuestion> make(HostBuffers& buffers);

  /// For SceneParts::has_inner.
  std::uint32_t* flag() const { return reinterpret_cast<std::uint32_t*>(memory_->data()); }
  /// The kernel that answers is in the stream.
  Result<void> asked(hipStream_t stream) { return memory_->record(stream); }
  /// Waits for that kernel.
  Result<bool> answer();

 private:
  InnerQuestion(HostBuffers& buffers, std::unique_ptr<HostBuffer> memory)
      : buffers_(&buffers), memory_(std::move(memory)) {}
  HostBuffers* buffers_;
  std::unique_ptr<HostBuffer> memory_;
};

/// Waits for the stream.
Result<InnerScenes> find_inner(const SceneArrays& from, hipStream_t stream);

/// A table with room for the objects of inner scenes, and the copies of their records. The memory is the stream's: it
/// ends with the object.
class Nesting {
 public:
  Nesting(InnerScenes& inner, std::uint32_t instances, hipStream_t stream)
      : inner_(inner), instances_(instances), stream_(stream), memory_(nullptr, stream) {}

  /// @param records of the instances' objects.
  /// @param copies room for inner.instances records.
  /// @return the whole table.
  Result<ObjectRecord*> enqueue(const ObjectRecord* records, InstanceRecord* copies);

 private:
  InnerScenes& inner_;
  std::uint32_t instances_;
  hipStream_t stream_;
  Scratch memory_;
};

}  // namespace hiprt::api
