#pragma once
/// HIPRT's build inputs as this library's. Internal.
///
/// Inline: a batch asks this for each of a million geometries.

#include <hiprt_build/gpu/batch.h>
#include <hiprt_build/gpu/import.h>

#include <hiprt/hiprt.h>

#include <span>

namespace hiprt::api {

using GeometryInputs = std::span<const hiprtGeometryBuildInput>;

enum class BuildKind { kFast = 0, kBalanced = 1, kHigh = 2, kImport = 3 };
inline BuildKind kind_of(const hiprtBuildOptions& options) { return static_cast<BuildKind>(options.buildFlags & 3u); }

/// An address that is never read, for pointers that the program does not have yet.
template <class T> const T* or_placeholder(const void* pointer) {
  static const char none = 0;
  return static_cast<const T*>(pointer != nullptr ? pointer : &none);
}

/// Triangles or boxes.
inline std::uint32_t primitive_count(const hiprtGeometryBuildInput& input) {
  if (input.type == hiprtPrimitiveTypeAABBList) return input.primitive.aabbList.aabbCount;
  const hiprtTriangleMeshPrimitive& mesh = input.primitive.triangleMesh;
  return mesh.triangleIndices == nullptr ? mesh.vertexCount / 3 : mesh.triangleCount;
}

/// Whether the counts are there: sizes and creation need no more.
inline bool has_counts(const hiprtGeometryBuildInput& input) {
  if (input.type == hiprtPrimitiveTypeAABBList) return input.primitive.aabbList.aabbCount != 0;
  if (input.type != hiprtPrimitiveTypeTriangleMesh) return false;
  const hiprtTriangleMeshPrimitive& mesh = input.primitive.triangleMesh;
  return mesh.triangleIndices == nullptr ? mesh.vertexCount >= 3 : mesh.vertexCount != 0 && mesh.triangleCount != 0;
}

/// A tree of one primitive has no nodes: then the builder makes it.
inline bool imports(const hiprtGeometryBuildInput& input, const hiprtBuildOptions& options) {
  return kind_of(options) == BuildKind::kImport && input.nodeList.nodeCount > 1;
}

/// Whether counts and pointers are there that a build reads.
inline bool is_valid(const hiprtGeometryBuildInput& input, const hiprtBuildOptions& options) {
  if (!has_counts(input)) return false;
  const hiprtBvhNodeList& list = input.nodeList;
  if (imports(input, options) && (list.internalNodes == nullptr || list.leafNodes == nullptr)) return false;
  return input.type == hiprtPrimitiveTypeAABBList ? input.primitive.aabbList.aabbs != nullptr
                                                  : input.primitive.triangleMesh.vertices != nullptr;
}

/// Pointers that are null become others: sizes do not depend on them.
inline gpu::DeviceGeometry geometry_of(const hiprtGeometryBuildInput& input) {
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

gpu::DeviceTree tree_of(const hiprtGeometryBuildInput& input);
gpu::BuildOptions options_of(const hiprtBuildOptions& options);

}  // namespace hiprt::api
