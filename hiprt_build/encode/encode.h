#pragma once
/// Encodes a wide tree into the bytes of a file. Internal.

#include <hiprt_build/collapse/collapse.h>
#include <hiprt_build/error.h>
#include <hiprt_build/pair/pair.h>

#include <string>

namespace hiprt::build {

struct EncodeInput {
  const BuildInput& scene;
  const PairedPrimitives& paired;
  const DepthFirstTree& tree;
  const WideTree& wide;
  NodeLayout layout;
  bool widen_boxes;
  std::string provenance;  ///< Of make_provenance(); encode() sets its exchange slack.
};

/// @return kTooLarge, with the numbers, if so many nodes and leaves end after kAddressLimit.
Result<void> check_addresses(NodeLayout layout, std::uint64_t nodes, std::uint64_t leaves);

/// Writes a file. Nodes lie in depth-first order with siblings side by side, leaves in the order of the tree. Boxes are
/// encoded from the leaves to the root: a parent holds for a child node the box that the child's bytes decode to.
/// @pre layout kQuantized: coordinates are below kQuantizedLimit.
/// @return the error of check_addresses().
Result<Buffer> encode(CpuEngine& engine, const EncodeInput& input);

}  // namespace hiprt::build
