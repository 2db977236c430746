#include <hiprt_build/hiprt_api/geometry_input.h>

#include <algorithm>

namespace hiprt::api {

namespace {

/// An address that is never read, for pointers that the program does not have yet.
template <class T> const T* or_placeholder(const void* pointer) {
  static const char none = 0;
  return static_cast<const T*>(pointer != nullptr ? pointer : &none);
}

}  // namespace

std::uint32_t primitive_count(const hiprtGeometryBuildInput& input) {
  if (input.type == hiprtPrimitiveTypeAABBList) return input.primitive.aabbList.aabbCount;
  const hiprtTriangleMeshPrimitive& mesh = input.primitive.triangleMesh;
  return mesh.triangleIndices == nullptr ? mesh.vertexCount / 3 : mesh.triangleCount;
}

bool has_counts(const hiprtGeometryBuildInput& input) {
  if (input.type == hiprtPrimitiveTypeAABBList) return input.primitive.aabbList.aabbCount != 0;
  if (input.type != hiprtPrimitiveTypeTriangleMesh) return false;
  const hiprtTriangleMeshPrimitive& mesh = input.primitive.triangleMesh;
  return mesh.triangleIndices == nullptr ? mesh.vertexCount >= 3 : mesh.vertexCount != 0 && mesh.triangleCount != 0;
}

bool is_valid(const hiprtGeometryBuildInput& input, const hiprtBuildOptions& options) {
  if (!has_counts(input)) return false;
  const hiprtBvhNodeList& list = input.nodeList;
  if (imports(input, options) && (list.internalNodes == nullptr || list.leafNodes == nullptr)) return false;
  return input.type == hiprtPrimitiveTypeAABBList ? input.primitive.aabbList.aabbs != nullptr
                                                  : input.primitive.triangleMesh.vertices != nullptr;
}

gpu::DeviceGeometry geometry_of(const hiprtGeometryBuildInput& input) {
  gpu::DeviceGeometry geometry;
  geometry.type = input.geomType == hiprtInvalidValue ? 0 : input.geomType + 1;
  geometry.primitive_count = primitive_count(input);
  if (input.type == hiprtPrimitiveTypeAABBList) {
    const hiprtAABBListPrimitive& list = input.primitive.aabbList;
    geometry.boxes = or_placeholder<Box>(list.aabbs);
    geometry.box_stride = list.aabbStride != 0 ? list.aabbStride : static_cast<std::uint32_t>(sizeof(Box));
    geometry.box_upper = geometry.box_stride / 2;
    return geometry;
  }
  const hiprtTriangleMeshPrimitive& mesh = input.primitive.triangleMesh;
  geometry.positions = or_placeholder<build::Position>(mesh.vertices);
  geometry.position_count = mesh.vertexCount;
  if (mesh.vertexStride != 0) geometry.position_stride = mesh.vertexStride;
  if (mesh.triangleIndices == nullptr) {
    geometry.implicit_triangles = true;
  } else {
    geometry.triangles = static_cast<const build::Triangle*>(mesh.triangleIndices);
    if (mesh.triangleStride != 0) geometry.triangle_stride = mesh.triangleStride;
  }
  if (mesh.trianglePairIndices != nullptr && mesh.trianglePairCount != 0) {
    geometry.pairs = static_cast<const build::TrianglePair*>(mesh.trianglePairIndices);
    geometry.pair_count = mesh.trianglePairCount;
  }
  return geometry;
}

gpu::DeviceTree tree_of(const hiprtGeometryBuildInput& input) {
  static_assert(sizeof(gpu::ImportedNode) == sizeof(hiprtInternalNode));
  static_assert(sizeof(gpu::ImportedLeaf) == sizeof(hiprtLeafNode));
  return {.nodes = or_placeholder<gpu::ImportedNode>(input.nodeList.internalNodes),
          .leaves = or_placeholder<gpu::ImportedLeaf>(input.nodeList.leafNodes),
          .leaf_count = input.nodeList.nodeCount};
}

bool imports(const hiprtGeometryBuildInput& input, const hiprtBuildOptions& options) {
  return kind_of(options) == BuildKind::kImport && input.nodeList.nodeCount > 1;
}

gpu::BuildOptions options_of(const hiprtBuildOptions& options) {
  gpu::BuildOptions result;
  switch (kind_of(options)) {
    case BuildKind::kFast:
      result.builder = build::Builder::kLbvh;
      break;
    case BuildKind::kHigh:
      result.builder = build::Builder::kHq;
      break;
    default:
      result.builder = build::Builder::kHploc;
  }
  if ((options.buildFlags & hiprtBuildFlagBitDisableSpatialSplits) != 0) result.split_budget = 1.0;
  result.pair_triangles = (options.buildFlags & hiprtBuildFlagBitDisableTrianglePairing) == 0;
  return result;
}

gpu::BuildOptions batch_options() { return {.builder = build::Builder::kHploc}; }

bool is_small(const hiprtGeometryBuildInput& input, const hiprtBuildOptions& options) {
  const std::uint32_t most = std::min(options.batchBuildMaxPrimCount, gpu::kBatchTriangles);
  return kind_of(options) != BuildKind::kImport && primitive_count(input) <= most;
}

}  // namespace hiprt::api
