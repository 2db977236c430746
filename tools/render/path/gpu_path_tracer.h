#pragma once
/// Traces waves of paths on a GPU. In a build without GPU code make() returns an error that says so.

#include <tools/render/path/path_batch.h>
#include <tools/render/path/path_data.h>

#include <memory>
#include <span>

namespace hiprt::tools {

class GpuTracer;

/// A picture in the memory of a GpuTracer's GPU. One thread at a time may use it.
class GpuPathTracer {
 public:
  /// Copies the arrays to the device.
  /// @param tracer has the scene, and must live as long as this.
  /// @return kOutOfMemory with the bytes wanted and free; kGpu; kNoDevice.
  static build::Result<GpuPathTracer> make(GpuTracer& tracer, const PathData& data, const PathSettings& settings);

  GpuPathTracer(GpuPathTracer&&) noexcept;
  GpuPathTracer& operator=(GpuPathTracer&&) noexcept;
  ~GpuPathTracer();

  /// GpuTracer::make_current().
  build::Result<void> make_current() const;

  /// Most paths of a batch.
  std::uint32_t capacity() const;
  build::Result<void> run(const PathBatch& batch, PathRayCounts& rays);
  /// Later batches belong to this rectangle. Before the first call they belong to the picture, whose sums are 0.
  /// @param sums of the rectangle's pixels, row by row.
  build::Result<void> load(const PathBatch& rectangle, std::span<const PathSum> sums);
  /// @param sums of the rectangle, or of the whole picture.
  build::Result<void> download(std::span<PathSum> sums);

 private:
  struct State;
  explicit GpuPathTracer(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

}  // namespace hiprt::tools
