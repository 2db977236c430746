#pragma once
/// Traces batches of rays on a GPU. In a build without GPU code make() returns an error that says so.

#include <tools/render/tracers/tracer.h>

#include <hiprt_build/error.h>
#include <hiprt_build/format/view.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace hiprt::tools {

struct GpuTracerOptions {
  /// Number of the GPU, as hipSetDevice() takes it. It becomes the current one of the calling thread. Nothing: the
  /// current one.
  std::optional<int> device{};
  /// Rays of a part, more than 0. The default fills a GPU many times over. It takes 150 MB with the hits, and 8 MB more
  /// for each level of the instance paths.
  std::size_t rays_at_once = std::size_t{1} << 21;
  /// The policies that trace() will be called with.
  TracePolicies policies{};
};

/// Rays in device memory.
struct DeviceRays {
  const Ray* rays;
  Hit* hits;
  std::uint32_t* paths;  ///< SceneView::levels entries per ray. nullptr: paths are not stored.
  std::uint32_t count;
};

/// A scene on the process's current GPU. One thread at a time may use it.
class GpuTracer {
 public:
  /// Copies the scene to the device.
  /// @param view of a file that validate() and check_traceable() (bvh_file.h) accept.
  /// @return kOutOfMemory with the bytes wanted and free, kGpu, or kNoDevice if
  /// - there is no GPU, or this build has no GPU code;
  /// - the GPU code was not compiled for the GPU's architecture;
  /// - the architecture has no kernel for the scene and the policies.
  static build::Result<GpuTracer> make(const BufferView& view, const GpuTracerOptions& options = {});

  /// @return the PCI addresses of the process's GPUs, in the order of their numbers; empty without a GPU. Processes of
  /// one host that may use the same GPU get the same address.
  static std::vector<std::string> devices();

  GpuTracer(GpuTracer&&) noexcept;
  GpuTracer& operator=(GpuTracer&&) noexcept;
  ~GpuTracer();

  /// Makes the GPU the current one of the calling thread. Call it before other threads than make()'s use it.
  build::Result<void> make_current() const;

  /// "NVIDIA H200, sm_90"
  const std::string& device_name() const;

  /// The scene in device memory.
  const SceneView& scene() const;

  /// Starts tracing on the default stream, with the default policies, and does not wait for it.
  /// @param cutout_scene on the device, for the filter AlphaCutout. nullptr: no filter.
  /// @return the errors of a launch. Rays that overflow their stacks are Hit::failed().
  build::Result<void> trace_on_device(Query query, const DeviceRays& rays, const PathScene* cutout_scene = nullptr);

  /// Traces rays[i] into hits[i], part by part, so that device memory stays bounded.
  /// @param hits as many as rays: the same, bit for bit, as the hits of trace().
  /// @param progress called after every part with the finished fraction.
  /// @param paths as for trace(). @param cutout_scene as for trace_on_device(), with the default policies.
  /// @return the seconds that the device spent in kernels, or an error:
  /// - kCancelled: interrupted() became true between parts;
  /// - kOutOfMemory;
  /// - kGpu: also if rays overflowed their stacks. The message names their number and the stack's bound.
  build::Result<double> trace(Query query, const TracePolicies& policies, std::span<const Ray> rays,
                              std::span<Hit> hits, const std::function<void(double)>& progress = {},
                              std::span<std::uint32_t> paths = {}, const PathScene* cutout_scene = nullptr);

 private:
  struct State;
  explicit GpuTracer(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

}  // namespace hiprt::tools
