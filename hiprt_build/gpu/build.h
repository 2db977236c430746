#pragma once
/// Builds BVHs from meshes and custom primitives in device memory. The host does not wait, and no data leaves the
/// device.
///
///     hiprt::gpu::DeviceGeometry mesh{.positions = positions, .triangles = triangles,
///                                     .position_count = 8, .primitive_count = 12};
///     auto built = hiprt::gpu::build_scene({&mesh, 1}, {}, stream, allocator);
///     if (!built) std::cerr << built.error().message;
///     trace<<<...>>>(built->view, ...);

#include <hiprt_build/build.h>
#include <hiprt_build/gpu/device_buffer.h>
#include <hiprt_device/scene_view.h>

#include <cstdint>
#include <optional>
#include <span>

namespace hiprt::gpu {

/// A mesh or custom primitives. It becomes one geometry. All pointers are to device memory, which the stream reads
/// until it has passed the build. build::TriangleMesh and build::CustomGeometry say which primitives are dropped.
/// Triangles with an index past the positions are dropped too, and counted.
struct DeviceGeometry {
  const build::Position* positions = nullptr;
  const build::Triangle* triangles = nullptr;  ///< nullptr only with implicit_triangles.
  /// Of custom primitives; then positions and triangles are nullptr. A custom geometry without primitives needs an
  /// address other than nullptr, too.
  const Box* boxes = nullptr;
  std::uint32_t position_count = 0;
  std::uint32_t primitive_count = 0;  ///< Triangles or boxes. Of all geometries at most kMaxBuildPrimitives.
  std::uint32_t mask = 0xffffffffu;   ///< As build::TriangleMesh::mask.
  std::uint32_t type = 0;             ///< As build::TriangleMesh::type and build::CustomGeometry::type.
  /// Triangle i has the positions 3 i, 3 i + 1 and 3 i + 2; as build::TriangleMesh::implicit_triangles.
  bool implicit_triangles = false;
  /// In bytes, multiples of 4: the distances between positions, triangles and boxes in memory.
  std::uint32_t position_stride = sizeof(build::Position);
  std::uint32_t triangle_stride = sizeof(build::Triangle);
  std::uint32_t box_stride = sizeof(Box);
  /// Offset in bytes of a box's upper corner: a multiple of 4. Boxes of two float4 have stride 32 and offset 16.
  std::uint32_t box_upper = sizeof(float[3]);
  /// As build::TriangleMesh::pairs; nullptr: the builder chooses. Pairs with triangles that do not exist are ignored.
  const build::TrianglePair* pairs = nullptr;
  std::uint32_t pair_count = 0;
};

/// Primitives of one build, all geometries together.
inline constexpr std::uint32_t kMaxBuildPrimitives = (1u << 28) - 2;

struct BuildOptions {
  /// Any except Embree's and kImported. kSbvh with 8 rounds of reinsertion builds in a fraction of kHq's time.
  build::Builder builder = build::Builder::kHploc;
  NodeLayout nodes = NodeLayout::kPlanes;
  std::optional<double> split_budget{};          ///< As build::BuildOptions. kSplitsAsNeeded: BuildSteps only.
  double presplit_budget = 1.0;                  ///< As build::BuildOptions.
  std::optional<unsigned> reinsertion_rounds{};  ///< As build::BuildOptions.
  unsigned ploc_radius = 8;                      ///< As build::BuildOptions.
  unsigned max_leaf_triangles = 8;               ///< As build::BuildOptions.
  /// Two triangles with a common edge, or two close custom primitives, per leaf.
  bool pair_triangles = true;
  bool widen_boxes = false;  ///< As build::BuildOptions.
  build::SahCosts costs{};
  /// Called before each step and, where steps are long, between their rounds or levels. Before that the host waits for
  /// what was started. Return false to cancel. Unset: no waiting.
  build::ProgressCallback progress{};
};

/// Bytes of device memory that a build needs. They do not depend on the primitives' positions.
struct BuildSizes {
  std::uint64_t output = 0;   ///< For the scene. compact() keeps only what the scene needs.
  std::uint64_t scratch = 0;  ///< Unused once the stream has passed the build.
};

enum class BuildStatus : std::uint32_t {
  kOk = 0,
  kBadIndex = 1,  ///< Triangles have an index past the positions. The scene is complete without those triangles.
  kTooDeep = 2,   ///< A traversal would need more than 180 stack entries: the scene is empty.
  kTooLarge = 3,  ///< Layout quantized: a coordinate of 2^126 or more; the scene is empty.
  kBadTree = 4,   ///< enqueue_import(): the nodes do not form a tree, see bad_node; the scene is empty.
};

/// The result of a build, in device memory. It is written when the stream passes the build. Without padding, so that it
/// can be copied as bytes.
struct BuildReport {
  SceneView view{};  ///< For kernels that follow on the stream.
  BuildStatus status = BuildStatus::kOk;
  std::uint32_t nodes = 0, leaves = 0;  ///< Records.
  std::uint32_t custom_leaves = 0;      ///< Of the leaves.
  std::uint32_t geometries = 0;
  std::uint32_t pairs = 0;  ///< Leaves with two primitives, before splitting.
  std::uint32_t dropped_not_finite = 0, dropped_degenerate = 0, bad_indices = 0;
  build::Builder builder = build::Builder::kHploc;  ///< That made the tree: kLbvh if kHploc's was too deep.
  std::uint32_t missing = 0;                        ///< enqueue_import(): primitives without a leaf.
  std::uint32_t bad_node = 0;  ///< kBadTree: a node, or nodes + number of a leaf, that is out of range or shared.
};

static_assert(sizeof(BuildReport) == sizeof(SceneView) + 12 * sizeof(std::uint32_t));

/// @return kInvalidInput or kTooLarge with the number and its limit, or the runtime's error.
Result<BuildSizes> build_sizes(std::span<const DeviceGeometry> geometries, const BuildOptions& options = {});

/// Starts a build on the stream and returns. It allocates nothing, copies nothing from or to the host, and waits only
/// if options.progress is set. It can be captured in a graph. The array @p geometries is read before the call returns.
/// @param output sizes.output bytes on the device, aligned to 256; becomes the scene: a BVH file with gaps between its
///        sections, without provenance and checksum.
/// @param scratch sizes.scratch bytes on the device, aligned to 256.
/// @return where the report will be, in @p output; or the errors of build_sizes() and of launches; or kCancelled.
Result<const BuildReport*> enqueue_build(std::span<const DeviceGeometry> geometries, const BuildOptions& options,
                                         std::byte* output, std::byte* scratch, hipStream_t stream);

/// A scene on the device.
struct BuiltScene {
  DeviceBuffer buffer;  ///< A BVH file without provenance and checksum.
  SceneView view;       ///< Points into buffer; valid as long as it.
  BuildReport report;   ///< Its view is the one above.
};

/// Copies the scene of enqueue_build() to a buffer of its exact size. Waits for the stream twice.
/// @param report of enqueue_build().
/// @return kTooLarge if the tree is too deep, kInvalidInput if coordinates are too large for layout quantized, or the
/// errors of DeviceBuffer.
Result<BuiltScene> compact(const BuildReport* report, hipStream_t stream, Allocator& allocator);

/// Builds and compacts, with memory from the allocator.
/// @return kInvalidInput if an index is past its positions, kCancelled, or the errors of the functions above.
Result<BuiltScene> build_scene(std::span<const DeviceGeometry> geometries, const BuildOptions& options,
                               hipStream_t stream, Allocator& allocator);

/// The scene's file in host memory, complete with provenance and checksum; waits for the stream.
/// @param tool for the provenance, e.g. the command line.
Result<build::Buffer> download_file(const BuiltScene& scene, std::string_view tool, hipStream_t stream);

}  // namespace hiprt::gpu
