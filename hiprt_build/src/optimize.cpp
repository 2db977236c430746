#include <hiprt_build/builders/optimize.h>

#include <hiprt_build/builders/reinsertion.h>
#include <hiprt_build/steps/flatten.h>

namespace hiprt::build {
namespace {

/// The linked tree's number of a node: of an inner one where its right half begins, which no two share.
LinkedRef linked_ref(const BinaryTree& tree, std::uint32_t node) {
  if (tree.nodes[node].count == 1) return tree.nodes[node].first | kLinkedLeaf;
  return tree.nodes[tree.right(node)].first;
}

}  // namespace

BinaryTree optimize(CpuEngine& engine, BinaryTree tree, unsigned rounds) {
  const std::size_t count = tree.references.size();
  if (count < 3 || rounds == 0) return tree;
  engine.monitor().start("reinsert", 0.73, tree.nodes.size() + count + count * 9 * rounds);
  auto nodes = engine.allocate<LinkedNode>(count);
  auto counts = engine.allocate<std::uint32_t>(count);
  auto parents = engine.allocate<std::uint32_t>(2 * count);
  LinkedRef root = linked_ref(tree, 0);
  engine.for_each(tree.nodes.size(), [&](std::size_t i) {
    const auto node = static_cast<std::uint32_t>(i);
    if (tree.nodes[node].count == 1) return;
    const LinkedRef ref = linked_ref(tree, node);
    nodes[ref] = LinkedNode{to_box(tree.nodes[node].box()),
                            {linked_ref(tree, tree.left(node)), linked_ref(tree, tree.right(node))}};
    counts[ref] = tree.nodes[node].count;
  });
  tree.nodes.release();
  const ScratchArray<Reference> references = std::move(tree.references);
  reinsert(engine,
           ParentedTree<LinkedTree<ReferenceLeaves>>{{{references.data()}, nodes.data(), {counts.data()}, &root},
                                                     static_cast<std::uint32_t>(count),
                                                     parents.data()},
           rounds);
  engine.monitor().start("order", 0.75, count);
  return flatten(engine, {references.span(), nodes.span(), counts.span(), root});
}

}  // namespace hiprt::build
