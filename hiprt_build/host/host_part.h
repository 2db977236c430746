#pragma once
/// What a host prepares of a file in memory when its view is asked for: see hiprt_device/host_scene.h.

#include <hiprt_build/export.h>

namespace hiprt {

struct BufferView;  ///< hiprt_build/format/view.h
struct SceneView;   ///< hiprt_device/scene_view.h

/// Makes the HostScene of one file, at the first call of scene().
///
/// That takes time and memory in proportion to the file's nodes (hiprt_device/docs/FILES.md).
class HIPRT_BUILD_API HostPart {
 public:
  HostPart();
  HostPart(HostPart&& other) noexcept;
  HostPart& operator=(HostPart&& other) noexcept;
  HostPart(const HostPart&) = delete;
  HostPart& operator=(const HostPart&) = delete;
  ~HostPart();

  /// The file's view. SceneView::host is nullptr if this processor has no fast tracer for the scene, or there is no
  /// memory for one. After a refit the next call prepares the file again, also for older views. No ray may be traced
  /// during that call. Otherwise any number of threads may call it at the same time.
  /// @param file always the same, and valid.
  SceneView scene(const BufferView& file) const;

 private:
  struct State;
  State* state_;  ///< Owned. nullptr after a move.
};

}  // namespace hiprt
