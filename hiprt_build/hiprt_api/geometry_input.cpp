#include <hiprt_build/hiprt_api/geometry_input.h>

namespace hiprt::api {

gpu::DeviceTree tree_of(const hiprtGeometryBuildInput& input) {
  static_assert(sizeof(gpu::ImportedNode) == sizeof(hiprtInternalNode));
  static_assert(sizeof(gpu::ImportedLeaf) == sizeof(hiprtLeafNode));
  return {.nodes = or_placeholder<gpu::ImportedNode>(input.nodeList.internalNodes),
          .leaves = or_placeholder<gpu::ImportedLeaf>(input.nodeList.leafNodes),
          .leaf_count = input.nodeList.nodeCount};
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

}  // namespace hiprt::api
