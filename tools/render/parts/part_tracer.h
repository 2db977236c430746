#pragma once
/// Traces rays through a part of a scene that this process has.

#include <tools/parts/part_data.h>
#include <tools/parts/path_numbers.h>
#include <tools/render/parts/part_answer.h>
#include <tools/render/path/gpu_path_scene.h>
#include <tools/render/path/path_data.h>
#include <tools/render/tracers/gpu_tracer.h>

#include <hiprt_build/buffer.h>
#include <hiprt_build/host/host_part.h>

#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace hiprt::tools {

class PartTracer {
 public:
  /// @param bvh whose content was validated and can be traced. @param data that belongs to it.
  /// @param levels of the whole scene. @param settings of the picture.
  /// @return the errors of make_path_data(). kInvalidInput if a material of it emits light.
  static build::Result<std::unique_ptr<PartTracer>> make(build::Buffer bvh, PartData data, std::uint32_t levels,
                                                         const PathSettings& settings);

  BufferView view() const { return view_; }
  /// Makes trace() use a GPU, for one batch at a time. The CPU computes surfaces.
  /// @param tracer of view(). @return the errors of GpuPathScene::make().
  build::Result<void> move_to(GpuTracer tracer);

  /// Any number of threads may call it at the same time.
  /// @return the errors of GpuTracer::trace().
  build::Result<PartAnswer> trace(Query query, std::span<const Ray> rays) const;

 private:
  PartTracer() = default;
  build::Result<void> find_hits(Query query, std::span<const Ray> rays, std::span<Hit> hits,
                                std::span<std::uint32_t> paths) const;

  build::Buffer buffer_;
  BufferView view_{};
  HostPart host_;
  PathData arrays_;
  std::optional<PathScene> scene_;
  PathNumbers numbers_;
  std::uint32_t levels_ = 1;
  bool alpha_cutout_ = false;
  mutable std::mutex gpu_mutex_;          ///< Guards the next two.
  mutable std::optional<GpuTracer> gpu_;  ///< Nothing: the CPU traces.
  std::optional<GpuPathScene> gpu_scene_;
};

}  // namespace hiprt::tools
