#include <hiprt_build/sah_sbvh/gpu_compact_tree.h>

#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/exec/gpu_scan.h>
#include <hiprt_build/pipeline/gpu_state.h>

namespace hiprt::build::kernels {
namespace {

/// New numbers: how many come before. Nodes are counted from 1, as those of every linked tree.
struct NewNumbers {
  std::uint32_t *leaves, *nodes;

  __device__ std::uint32_t node(std::uint32_t i) const { return nodes[i] + 1; }

  __device__ LinkedRef operator()(LinkedRef ref) const {
    return (ref & kLinkedLeaf) != 0 ? leaves[ref & ~kLinkedLeaf] | kLinkedLeaf : node(ref);
  }
};

__global__ void __launch_bounds__(kBlock) mark_used(gpu::GappedTree from, std::uint32_t slots, NewNumbers numbers) {
  const std::uint32_t i = thread_index();
  if (i >= slots) return;
  numbers.leaves[i] = from.leaves[i].contents.exists() ? 1 : 0;
  numbers.nodes[i] = from.nodes[i].child[0] != kInvalidId ? 1 : 0;
}

__global__ void __launch_bounds__(kBlock)
    move_tree(gpu::GappedTree from, std::uint32_t slots, NewNumbers numbers, gpu::CompactTree to) {
  const std::uint32_t i = thread_index();
  if (i >= slots) return;
  const Reference leaf = from.leaves[i];
  if (leaf.contents.exists()) to.leaves[numbers.leaves[i]] = leaf;
  LinkedNode node = from.nodes[i];
  if (node.child[0] == kInvalidId) return;
  for (LinkedRef& child : node.child) child = numbers(child);
  to.nodes[numbers.node(i)] = node;
}

__global__ void move_root(NewNumbers numbers, LinkedRef* root) {
  if (*root != kInvalidId) *root = numbers(*root);
}

}  // namespace
}  // namespace hiprt::build::kernels

namespace hiprt::gpu {
namespace {

using namespace build::kernels;

struct Scratch {
  NewNumbers numbers;
  std::size_t scan_bytes = 0;
  std::byte* scan;

  Scratch(Arena& arena, std::uint32_t slots)
      : numbers{arena.take<std::uint32_t>(slots), arena.take<std::uint32_t>(slots)} {
    // Only says how many bytes it needs: cannot fail.
    (void)build::exclusive_scan(nullptr, scan_bytes, nullptr, nullptr, slots, nullptr, nullptr);
    scan = arena.take<std::byte>(scan_bytes);
  }
};

}  // namespace

std::uint64_t compact_tree_scratch(std::uint32_t slots) {
  Arena arena;
  Scratch(arena, slots);
  return arena.size();
}

Result<void> enqueue_compact_tree(const GappedTree& from, std::uint32_t slots, const CompactTree& to, std::byte* memory,
                                  hipStream_t stream) {
  Arena arena(memory);
  Scratch scratch(arena, slots);
  Launcher steps(stream);
  steps.each(slots, "mark_used", mark_used, from, slots, scratch.numbers);
  for (std::uint32_t* numbers : {scratch.numbers.leaves, scratch.numbers.nodes})
    steps.then([&] {
      return build::exclusive_scan(scratch.scan, scratch.scan_bytes, numbers, numbers, slots, nullptr, stream);
    });
  steps.fill_bytes("leaves", to.leaves, to.capacity, 0xff);
  steps.fill_bytes("nodes", to.nodes, to.capacity, 0xff);
  steps.each(slots, "move_tree", move_tree, from, slots, scratch.numbers, to);
  steps.one("move_root", move_root, scratch.numbers, to.root);
  return steps.result();
}

}  // namespace hiprt::gpu
