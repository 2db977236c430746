#pragma once
/// The box nodes of a file, one after the other.

#include <hiprt_build/format/view.h>

#include <vector>

namespace hiprt::oracle {

/// @tparam Node of the file's layout.
template <class Node> std::vector<Node> nodes_of(const BufferView& view) {
  std::vector<Node> nodes;
  const auto in_file = view.node_array<Node>();
  for (std::uint64_t i = 0; i < view.node_count(); ++i) nodes.push_back(in_file[i]);
  return nodes;
}

}  // namespace hiprt::oracle
