#pragma once
/// Wide nodes and leaves of a tree in depth-first order, from the leaves to the root, on the CPU. Internal.

#include <hiprt_build/encode/encode.h>
#include <hiprt_build/encode/wide_node.h>
#include <hiprt_build/encode/write_leaf.h>
#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/format/file_layout.h>
#include <hiprt_device/math/atomic.h>

namespace hiprt::build {

/// What a parent needs to know of a child.
struct Subtree {
  WideChild child;
  std::uint32_t stack_need = 0;  ///< Entries that a traversal of it can need.
};

/// Writes nodes, leaves and primitive map of a file.
template <class Layout> class NodeWriter {
  static constexpr std::uint32_t kTaskNodes = 1024;

 public:
  using Node = typename Layout::Node;
  using Leaf = typename Layout::Leaf;

  NodeWriter(CpuEngine& engine, const EncodeInput& input, const FileLayout& file, std::byte* bytes)
      : engine_(engine),
        input_(input),
        file_(file),
        nodes_(bytes + file[kNodesAt].offset, NodePlaces(file[kNodesAt], Layout::kId)),
        leaf_writer_{input.scene.table(), reinterpret_cast<Leaf*>(bytes + file[kLeavesAt].offset)},
        map_(reinterpret_cast<std::uint32_t*>(bytes + file[kPrimitiveMapAt].offset)) {}

  /// Fills nodes, leaves and primitive map. @return the root, with the file's bounds.
  Subtree run() {
    engine_.fill(std::span(map_, file_[kPrimitiveMapAt].count), kInvalidId);
    const std::size_t leaves = input_.tree.references.size();
    if (leaves == 0) return Subtree{};
    engine_.for_each(leaves, [this](std::size_t i) { write_leaf(static_cast<std::uint32_t>(i)); });
    if (input_.wide.is_run(0)) return end_run(0);
    Subtree root = write_node(0, 0, 1);
    root.child.box = bounded(root.child.box, input_.tree.nodes[0].box);
    return root;
  }

 private:
  NodeRef node_ref(std::uint64_t i) const {
    return make_ref(file_[kNodesAt].offset + nodes_.places().offset(i), Layout::kBoxType);
  }
  NodeRef leaf_ref(std::uint64_t i, NodeType type) const {
    return make_ref(file_[kLeavesAt].offset + i * sizeof(Leaf), type);
  }

  void write_leaf(std::uint32_t i) {
    const Reference& reference = input_.tree.references[i];
    const LeafPrimitives leaf{reference.primitive, reference.contents};
    Box box;
    leaf_writer_.write(i, leaf, false, box);
    lower(&map_[leaf.primitive], 2 * i);
    if (leaf.contents.is_pair()) lower(&map_[leaf.primitive + leaf.contents.distance()], 2 * i + 1);
  }

  /// The run of leaves of a binary node.
  Subtree end_run(std::uint32_t binary) {
    const DepthFirstNode& node = input_.tree.nodes[binary];
    leaf_writer_.leaves[node.first + node.count - 1].info.geometry_and_flags |= kLastInRun;
    const bool custom = input_.wide.is_custom(binary);
    return Subtree{{leaf_ref(node.first, custom ? NodeType::kProcedural : NodeType::kTriangle0),
                    kChildOnlyOpaque | (custom ? kChildOnlyProcedural : kChildOnlyTriangles), node.box}};
  }

  /// Writes the wide node of a binary node to nodes_[at] and its subtree to nodes_[next, ...).
  Subtree write_node(std::uint32_t binary, std::uint64_t at, std::uint64_t next) {
    const WideTree::Children children = input_.wide.children(binary);
    std::uint64_t slot[kBranching], subtree[kBranching];
    plan_children(children, next, slot, subtree);
    Subtree below[kBranching];
    const auto descend = [&](unsigned i) {
      if (i >= children.count) return;
      const std::uint32_t child = children.node[i];
      below[i] = input_.wide.is_run(child) ? end_run(child) : write_node(child, slot[i], subtree[i]);
    };
    if (input_.wide.node_count(binary) < kTaskNodes) {
      for (unsigned i = 0; i < kBranching; ++i) descend(i);
    } else {
      engine_.monitor().check();
      engine_.invoke([&] { engine_.invoke([&] { descend(0); }, [&] { descend(1); }); },
                     [&] { engine_.invoke([&] { descend(2); }, [&] { descend(3); }); });
    }
    return write_record(at, below, children.count);
  }

  /// The node over finished subtrees. What it states for itself is what its bytes decode to.
  Subtree write_record(std::uint64_t at, const Subtree (&below)[kBranching], unsigned count) {
    WideChild children[kBranching];
    Subtree result{{node_ref(at), below[0].child.flags}};
    for (unsigned i = 0; i < count; ++i) {
      children[i] = below[i].child;
      result.child.flags &= below[i].child.flags;
      result.stack_need = std::max(result.stack_need, below[i].stack_need);
    }
    result.stack_need += count - 1;
    nodes_[at] = make_node<Layout>(children);
    result.child.box = node_box<Layout>(nodes_[at]);
    return result;
  }

  /// Siblings get neighbouring slots from @p next on, then their subtrees follow one after the other.
  void plan_children(const WideTree::Children& children, std::uint64_t next, std::uint64_t* slot,
                     std::uint64_t* subtree) const {
    for (unsigned i = 0; i < children.count; ++i)
      if (!input_.wide.is_run(children.node[i])) slot[i] = next++;
    for (unsigned i = 0; i < children.count; ++i) {
      if (input_.wide.is_run(children.node[i])) continue;
      subtree[i] = next;
      next += input_.wide.node_count(children.node[i]) - 1;
    }
  }

  CpuEngine& engine_;
  const EncodeInput& input_;
  const FileLayout& file_;
  NodeArray<Node> nodes_;
  LeafWriter<Layout> leaf_writer_;
  std::uint32_t* map_;
};

}  // namespace hiprt::build
