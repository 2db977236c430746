#pragma once
/// Speed of kernels with HIPRT's names beside this library's own.

#include "trace_job.h"

#include <hiprt_build/gpu/device_buffer.h>
#include <tools/render/scene/camera.h>

#include <hiprt/hiprt.h>
#include <nlohmann/json_fwd.hpp>

#include <string>
#include <vector>

namespace hiprt::bench {

/// Rays of one kind.
struct NamedRays {
  std::string kind;
  bool any_hit;
  std::vector<hiprtRay> rays;
};

/// A scene for the traces, on the device.
struct TracedScene {
  std::string name;
  hiprtGeometry geometry = nullptr;
  hiprtScene scene = nullptr;
};

/// Primary, ao and diffuse rays of a picture, row by row. Traces on the device.
/// @param bounds of the geometry.
build::Result<std::vector<NamedRays>> make_named_rays(hiprtGeometry geometry, const Box& bounds,
                                                      const tools::Camera& camera, unsigned width, unsigned height,
                                                      hipStream_t stream);

/// Times all kernels on all rays and compares their hits.
/// @param results JSON is appended: one object per kernel and kind.
/// @return a table; or an error, also if a kernel's hits differ from those of this library's own query.
build::Result<std::string> time_traces(const TracedScene& scene, const std::vector<NamedRays>& rays, unsigned repeats,
                                       hipStream_t stream, nlohmann::json& results);

/// @return a table of registers and memory of all kernels.
build::Result<std::string> describe_kernels(nlohmann::json& results);

}  // namespace hiprt::bench
