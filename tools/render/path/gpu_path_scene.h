#pragma once
/// A path tracer's scene in the memory of a GPU. In a build without GPU code make() returns an error that says so.

#include <tools/render/path/path_data.h>

#include <memory>

namespace hiprt::tools {

class GpuTracer;

class GpuPathScene {
 public:
  /// Copies the arrays to the device.
  /// @param tracer has the scene, and must live as long as this.
  /// @return kOutOfMemory with the bytes wanted and free; kGpu; kNoDevice.
  static build::Result<GpuPathScene> make(GpuTracer& tracer, const PathData& data, const PathSettings& settings);

  GpuPathScene(GpuPathScene&&) noexcept;
  GpuPathScene& operator=(GpuPathScene&&) noexcept;
  ~GpuPathScene();

  /// With arrays in device memory.
  const PathScene& scene() const;
  /// The same in device memory, for the filter AlphaCutout. nullptr: no material cuts anything out.
  const PathScene* cutout_scene() const;

 private:
  struct State;
  explicit GpuPathScene(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

}  // namespace hiprt::tools
