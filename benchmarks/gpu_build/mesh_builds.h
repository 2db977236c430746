#pragma once
/// Builds of one mesh by one builder.

#include "measured.h"

#include <benchmarks/common/device_memory.h>
#include <hiprt_build/gpu/build.h>
#include <hiprt_build/gpu/device_buffer.h>

#include <span>
#include <string>

namespace hiprt::bench {

/// One mesh on the device.
class DeviceMesh {
 public:
  static build::Result<DeviceMesh> make(std::string name, std::span<const build::Position> positions,
                                        std::span<const build::Triangle> triangles);
  gpu::DeviceGeometry geometry() const;

  std::string name;

 private:
  gpu::DeviceArray<build::Position> positions_;
  gpu::DeviceArray<build::Triangle> triangles_;
};

struct MeshBench {
  unsigned repeats = 15;         ///< Timed builds, after 3 others.
  bool pairs = true;             ///< Leaves with pairs of triangles.
  std::string nodes = "planes";  ///< A layout's name.
  std::string save;              ///< Folder for the BVHs; empty: none.
};

/// Times the builds; then builds once more into dirty memory, validates and measures the tree, and times refits.
/// @param builder for parse_builder(). @return kInvalidInput for unknown names; kBackend if the BVH is not valid.
build::Result<Measured> measure(const DeviceMesh& mesh, const std::string& builder, const MeshBench& bench,
                                hipStream_t stream);

}  // namespace hiprt::bench
