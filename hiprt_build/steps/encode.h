#pragma once
/// Wide tree to the bytes of a file. Internal.

#include <hiprt_build/error.h>
#include <hiprt_build/steps/collapse.h>
#include <hiprt_build/steps/pair.h>

#include <string>

namespace hiprt::build {

struct EncodeInput {
  const TriangleSoup& soup;
  const GroupedTriangles& grouped;
  const BinaryTree& tree;
  const WideTree& wide;
  NodeLayout layout;
  std::string provenance;  ///< JSON
};

/// Writes a whole file. Nodes lie in depth-first order with siblings side by side, leaves in the order of the tree.
/// @return kTooLarge when the last node or leaf would be beyond kAddressLimit.
Result<Buffer> encode(CpuEngine& engine, const EncodeInput& input);

}  // namespace hiprt::build
