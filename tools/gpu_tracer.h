#pragma once
/// Batches of rays through the traversal on a GPU. A build without GPU code has the same class, which says so.

#include "tracer.h"

#include <hiprt_build/error.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <string>

namespace hiprt::tools {

struct GpuTracerOptions {
  /// Rays of a part, more than 0. The default fills a GPU many times over and takes 150 MB with the hits, and 8 MB
  /// for each level of the paths.
  std::size_t rays_at_once = std::size_t{1} << 21;
};

/// A scene on the process's current GPU. One thread at a time may use it.
class GpuTracer {
 public:
  /// Copies the scene to the device.
  /// @param view of a file that validate() accepts.
  /// @return kNoDevice: this build has no GPU code, there is no GPU, or its architecture is not among those that the
  /// code was compiled for, or the scene has more levels of instances than kGpuTraceLevels; kOutOfMemory with the bytes
  /// wanted and free; kGpu.
  static build::Result<GpuTracer> make(const BufferView& view, const GpuTracerOptions& options = {});

  GpuTracer(GpuTracer&&) noexcept;
  GpuTracer& operator=(GpuTracer&&) noexcept;
  ~GpuTracer();

  /// "NVIDIA H200, sm_90"
  const std::string& device_name() const;

  /// Traces rays[i] into hits[i], part by part, so that device memory stays bounded.
  /// @param hits as many as rays: the same, bit for bit, as trace() gives.
  /// @param progress called behind every part with the finished fraction.
  /// @param paths as for trace().
  /// @return the seconds that the device spent in kernels; kCancelled when interrupted() became true between parts;
  /// kOutOfMemory; kGpu, also when rays overflowed their stacks: their number and the stack's bound are said.
  build::Result<double> trace(Query query, const TracePolicies& policies, std::span<const Ray> rays,
                              std::span<Hit> hits, const std::function<void(double)>& progress = {},
                              std::span<std::uint32_t> paths = {});

 private:
  struct State;
  explicit GpuTracer(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

}  // namespace hiprt::tools
