#pragma once
/// New boxes for scenes on the device whose primitives have moved: the same tree, several times faster than a build.
///
///     auto scratch = hiprt::gpu::refit_scratch(scene);
///     auto report = hiprt::gpu::enqueue_refit(scene, {&mesh, 1}, scratch_memory, stream);
///     trace<<<...>>>(report->view, ...);  // On the same stream.

#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/build.h>
#include <hiprt_build/gpu/scene.h>

namespace hiprt::gpu {

/// The parts of a scene on the device that a refit needs to know of.
struct SceneParts {
  std::byte* base = nullptr;
  NodeLayout layout = NodeLayout::kPlanes;
  NodeRef root = kInvalidRef;
  std::uint64_t first_node = 0, nodes = 0;  ///< Byte offset in the file, and how many.
  bool node_gaps = false;                   ///< Whether 64 bytes are unused after every 64 nodes (FORMAT_NODES.md).
  std::uint64_t first_leaf = 0, leaves = 0;
  const GeometryRecord* geometries = nullptr;  ///< On the device.
  std::uint32_t geometry_count = 0;
};

SceneParts parts_of(BuiltScene& scene);
/// @param view of the file on the host whose copy @p scene is.
SceneParts parts_of(DeviceScene& scene, const BufferView& view);

/// Why a refit has left the scene as it was. As build::refit(), which says more.
enum class RefitStatus : std::uint32_t {
  kOk = 0,
  kOtherScene = 1,  ///< Numbers or kinds of geometries or primitives are not the scene's.
  kBadIndex = 2,    ///< A triangle of the tree has an index beyond the positions.
  kNotFinite = 3,
  kInverted = 4,   ///< A custom primitive's box.
  kTooLarge = 5,   ///< A coordinate is beyond what layout quantized holds.
  kComeApart = 6,  ///< Two triangles of one leaf have lost their common edge.
};

/// In device memory, written when the stream passes the work.
struct RefitReport {
  RefitStatus status = RefitStatus::kOk;
  std::uint32_t leaf = 0;     ///< The first leaf that stands in the way; of kOtherScene the geometry.
  SceneView view{};           ///< For kernels that follow on the stream: its bounds have changed.
  double sah_cost = 0;        ///< As build::measure_tree().
  double exchange_slack = 0;  ///< Likewise. More than build::RefitOptions::rebuild_slack above that after the build: a
                              ///< rebuild would make rays a good deal faster.
};

/// Bytes of device memory that enqueue_refit() and enqueue_quality() need.
std::uint64_t refit_scratch(const SceneParts& scene);

/// Starts a refit on the stream and returns: no allocation, no wait; it can be captured in a graph. Primitives that
/// were dropped stay dropped. (The CPU's refit refuses scenes where one of them could be hit now; this one cannot see.)
/// Of a scene with shapes boxes move and points do not: the report's view has no shapes (SceneView::shapes is 0).
/// @param moved as many geometries as the scene has, of the same kinds, with the same numbers of primitives.
/// @param scratch refit_scratch() bytes, aligned to 256; the report will be there.
/// @return where the report will be; kInvalidInput, or the errors of launches.
Result<const RefitReport*> enqueue_refit(const SceneParts& scene, std::span<const DeviceGeometry> moved,
                                         std::byte* scratch, hipStream_t stream, const build::SahCosts& costs = {});

/// Only measures the tree: for the exchange slack after a build.
Result<const RefitReport*> enqueue_quality(const SceneParts& scene, std::byte* scratch, hipStream_t stream,
                                           const build::SahCosts& costs = {});

}  // namespace hiprt::gpu
