#pragma once
/// Many small BVHs at once, such as one per strand of hair: the device makes each in the shared memory of one block.
///
///     hiprt::gpu::DeviceBatch batch{positions, triangles, position_count, first, device_first};
///     auto sizes = hiprt::gpu::batch_sizes(batch);
///     auto scenes = hiprt::gpu::enqueue_batch(batch, {}, output, scratch, stream);
///     trace<<<...>>>(scenes->views, ...);

#include <hiprt_build/gpu/build.h>

namespace hiprt::gpu {

/// Meshes that lie one behind the other in the same arrays. All pointers are to device memory, which is read until the
/// stream has passed the build.
struct DeviceBatch {
  const build::Position* positions = nullptr;
  const build::Triangle* triangles = nullptr;
  std::uint32_t position_count = 0;
  /// On the host, never decreasing: mesh i has the triangles [first[i], first[i + 1]), so there is one more than
  /// meshes, and first[0] is 0. Read before the call returns.
  std::span<const std::uint32_t> first{};
  const std::uint32_t* device_first = nullptr;  ///< The same numbers on the device.
};

/// Geometries with arrays and strides of their own: meshes and boxes in any mixture. They may share arrays. Pairs are
/// ignored, except by geometries that are built by themselves.
struct GeometryBatch {
  std::span<const DeviceGeometry> geometries{};       ///< On the host: read before the call returns.
  const DeviceGeometry* device_geometries = nullptr;  ///< The same on the device.
};

/// A geometry with more primitives is built by itself, as build_scene() does, after the others; it takes memory twice.
inline constexpr std::uint32_t kBatchTriangles = 256;

/// In device memory, written when the stream passes the build; sums over all meshes.
struct BatchReport {
  std::uint32_t dropped_not_finite = 0, dropped_degenerate = 0, bad_indices = 0;
  std::uint32_t too_deep = 0;  ///< Scenes that are empty because of BuildStatus::kTooDeep.
};

/// Numbers of records of one scene.
struct BatchCounts {
  std::uint32_t nodes = 0, leaves = 0;
  std::uint32_t gaps = 0;  ///< 1: 64 bytes are unused after every 64 nodes (FORMAT_NODES.md).
};

/// Where the results will be: in the output's memory.
struct BatchScenes {
  const SceneView* views = nullptr;  ///< Of mesh i, whose hits have geometry 0.
  const BatchReport* report = nullptr;
  const BatchCounts* counts = nullptr;  ///< Of mesh i.
  std::uint32_t count = 0;              ///< Number of meshes or geometries.
};

/// @param options builder, pairs, leaves and costs as for a scene; layout kPlanes.
/// @return kInvalidInput or kTooLarge with the number and its limit, or the runtime's error.
Result<BuildSizes> batch_sizes(const DeviceBatch& batch, const BuildOptions& options = {});

/// Starts the builds on the stream and returns, as enqueue_build().
Result<BatchScenes> enqueue_batch(const DeviceBatch& batch, const BuildOptions& options, std::byte* output,
                                  std::byte* scratch, hipStream_t stream);

/// The same for geometries.
Result<BuildSizes> batch_sizes(const GeometryBatch& batch, const BuildOptions& options = {});
Result<BatchScenes> enqueue_batch(const GeometryBatch& batch, const BuildOptions& options, std::byte* output,
                                  std::byte* scratch, hipStream_t stream);

/// Scenes of a batch in memory of their exact size.
struct CompactBatch {
  DeviceBuffer buffer;
  BatchScenes scenes;  ///< In the buffer.
};

/// Copies the scenes of a batch to a new buffer, without the gaps between them. Waits for the stream once. The old
/// output is unused once the stream has passed the copies.
/// @return kTooLarge if nodes and leaves would end beyond the addresses of node references, or the errors of
/// DeviceBuffer and of launches.
Result<CompactBatch> compact_batch(const BatchScenes& scenes, hipStream_t stream, Allocator& allocator);

/// One scene of a batch as a file in host memory: a geometry without provenance. Waits for the stream.
/// @param number below scenes.count.
/// @return kInvalidInput for a number that is none, or the errors of compact_batch().
Result<build::Buffer> download_file(const BatchScenes& scenes, std::uint32_t number, hipStream_t stream,
                                    Allocator& allocator);

}  // namespace hiprt::gpu
