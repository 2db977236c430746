#pragma once
/// Pictures of a scene.

#include <tools/render/image/image.h>
#include <tools/render/scene/shutter.h>

#include <hiprt_build/error.h>
#include <hiprt_device/scene_view.h>

#include <cstdint>
#include <functional>
#include <limits>

namespace hiprt::tools {

class GpuTracer;
struct Camera;
struct TreeBoxes;

enum class RenderMode {
  kAo,       ///< Clay below a soft sky: one shadow ray per sample.
  kPrimary,  ///< Clay lit from the eye.
  kNormals,  ///< 0.5 + 0.5 * normal, as display (not linear) values; a miss is black.
  kHeatmap,  ///< Box and leaf tests of the primary rays plus entered instances, with a legend.
  kBoxes,    ///< The boxes of a tree in different colours, with dark edges (RenderOptions::boxes).
};

struct RenderOptions {
  RenderMode mode = RenderMode::kAo;
  std::uint32_t width = 1024, height = 768;
  /// 1: one ray through the pixel's centre. More: spread over the pixel.
  std::uint32_t samples = 32;
  std::uint32_t seed = 0;
  /// Length of shadow rays in scene units.
  float ao_distance = std::numeric_limits<float>::infinity();
  /// Interval of Ray::time, covered evenly by the samples. The layers are of its middle.
  Shutter shutter{};
  const TreeBoxes* boxes = nullptr;  ///< For RenderMode::kBoxes: the scene is a BVH over their triangles.
  unsigned threads = 0;              ///< 0: all the machine has. The picture does not depend on it.
  bool layers = true;                ///< Fill all layers. False: only colours, which needs fewer rays.
};

struct RayCounts {
  std::uint64_t primary = 0, shadow = 0;
  std::uint64_t on_gpu = 0;     ///< Rays of all kinds that the GPU traced.
  std::uint64_t secondary = 0;  ///< Rays of paths after their first surface.
  // Of scenes in parts:
  std::uint64_t sent = 0;      ///< Visits of rays to parts of other processes.
  std::uint64_t messages = 0;  ///< With such rays, and with the answers.
  std::uint64_t bytes = 0;     ///< Of these messages.

  RayCounts& operator+=(const RayCounts& other) {
    primary += other.primary;
    shadow += other.shadow;
    on_gpu += other.on_gpu;
    secondary += other.secondary;
    sent += other.sent;
    messages += other.messages;
    bytes += other.bytes;
    return *this;
  }
};

struct Rendering {
  Image image;
  RayCounts rays;
  unsigned threads;
  double seconds;             ///< Ray generation, traversal and shading together.
  std::uint32_t samples = 0;  ///< Per pixel.
  double mean_steps = 0.0;    ///< RenderMode::kHeatmap: tests and instances per ray.
};

/// @param gpu traces the rays whose work is not counted. nullptr: the CPU traces all rays. The pixels are the same.
/// @param progress called with 0 to 1 from any thread, one at a time.
/// @return kCancelled when interrupted() became true; kInvalidInput when the tracer refuses the scene; the errors of
/// GpuTracer::trace().
build::Result<Rendering> render(const SceneView& scene, const Camera& camera, const RenderOptions& options,
                                const std::function<void(double)>& progress = {}, GpuTracer* gpu = nullptr);

}  // namespace hiprt::tools
