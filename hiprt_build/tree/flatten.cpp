#include <hiprt_build/tree/flatten.h>

#include <bit>
#include <vector>

namespace hiprt::build {
namespace {

constexpr std::uint32_t kTaskSize = 4096;

class Flattener {
 public:
  Flattener(CpuEngine& engine, const LinkedTreeView& linked, DepthFirstTree& tree)
      : engine_(engine), linked_(linked), tree_(tree) {}

  /// Writes the subtree to nodes[at, ...) and references[first, ...).
  void write(LinkedRef ref, std::uint32_t at, std::uint32_t first, unsigned depth) {
    if ((ref & kLinkedLeaf) != 0) {
      tree_.references[first] = linked_.leaves[ref & ~kLinkedLeaf];
      tree_.nodes[at] = {tree_.references[first].box, first, 1};
      engine_.monitor().add(1);
      return;
    }
    const std::uint32_t count = linked_.counts[ref];
    if (depth + static_cast<unsigned>(std::bit_width(count)) >= kMaxDepth) return write_halved(ref, at, first, count);
    const LinkedNode& node = linked_.nodes[ref];
    const std::uint32_t left = count_of(node.child[0]);
    tree_.nodes[at] = {node.box, first, count};
    const auto write_left = [&] { write(node.child[0], at + 1, first, depth + 1); };
    const auto write_right = [&] { write(node.child[1], at + 2 * left, first + left, depth + 1); };
    if (count < kTaskSize) {
      write_left();
      write_right();
    } else {
      engine_.invoke(write_left, write_right);
    }
  }

 private:
  std::uint32_t count_of(LinkedRef ref) const { return (ref & kLinkedLeaf) != 0 ? 1 : linked_.counts[ref]; }

  void write_halved(LinkedRef ref, std::uint32_t at, std::uint32_t first, std::uint32_t count) {
    std::uint32_t next = first;
    std::vector<LinkedRef> open{ref};
    while (!open.empty()) {
      const LinkedRef here = open.back();
      open.pop_back();
      if ((here & kLinkedLeaf) != 0) {
        tree_.references[next++] = linked_.leaves[here & ~kLinkedLeaf];
        engine_.monitor().add(1);
      } else {
        open.push_back(linked_.nodes[here].child[1]);
        open.push_back(linked_.nodes[here].child[0]);
      }
    }
    halve(at, first, count);
  }

  SimdBox halve(std::uint32_t at, std::uint32_t first, std::uint32_t count) {
    if (count >= kTaskSize) engine_.monitor().check();
    SimdBox box;
    if (count == 1) {
      box = simd_box(tree_.references[first]);
    } else {
      const std::uint32_t half = count / 2;
      box = halve(at + 1, first, half);
      box.add(halve(at + 2 * half, first + half, count - half));
    }
    tree_.nodes[at] = {to_box(box), first, count};
    return box;
  }

  CpuEngine& engine_;
  const LinkedTreeView& linked_;
  DepthFirstTree& tree_;
};

}  // namespace

DepthFirstTree flatten(CpuEngine& engine, const LinkedTreeView& linked) {
  DepthFirstTree tree;
  const std::size_t count = (linked.root & kLinkedLeaf) != 0 ? 1 : linked.counts[linked.root];
  tree.references = engine.allocate<Reference>(count);
  tree.nodes = engine.allocate<DepthFirstNode>(2 * count - 1);
  Flattener(engine, linked, tree).write(linked.root, 0, 0, 0);
  return tree;
}

}  // namespace hiprt::build
