#pragma once
/// A caller's binary tree as a linked one. Internal.
///
/// Leaves of dropped primitives have no place in a linked tree: their parents give way to the other child. The passes
/// are count_uses (leaves), link_children (nodes), make_leaves (leaves), splice (leaves), drop_bad_tree (all slots),
/// count_missing (primitives).

#include <hiprt_build/exchange/gpu_import.h>
#include <hiprt_build/pipeline/gpu_state.h>

namespace hiprt::build::kernels {

static __global__ void start_import(BuildState* state) {
  state->whole = state->counts.leaves;
  state->counts.leaves = state->counts.customs = 0;
  state->root = kInvalidId;
  state->bounds.clear();
}

static __global__ void __launch_bounds__(kBlock) count_uses(GpuImport job, BuildState* state) {
  const std::uint32_t i = thread_index();
  if (i >= job.tree.leaf_count) return;
  const GpuImport::Named named = job.named(i);
  if (!named.exists) {
    lower(&state->bad_node, job.tree.leaf_count - 1 + i);
    return;
  }
  for (const std::uint32_t reference : named.reference)
    if (reference != kInvalidId) fetch_add(&job.uses[reference], 1);
}

static __global__ void __launch_bounds__(kBlock) link_children(GpuImport job, BuildState* state) {
  const std::uint32_t i = thread_index(), leaves = job.tree.leaf_count;
  if (i + 1 >= leaves) return;
  const gpu::ImportedNode& node = job.tree.nodes[i];
  for (unsigned c = 0; c < 2; ++c) {
    const bool leaf = node.is_leaf[c] == 1, exists = node.is_leaf[c] < 2;
    // The root is no child.
    if (!exists || node.child[c] >= (leaf ? leaves : leaves - 1) || (!leaf && node.child[c] == 0) ||
        atomicExch(&job.parents[(leaf ? leaves : 0) + node.child[c]], i) != kInvalidId)
      lower(&state->bad_node, i);
  }
}

static __global__ void __launch_bounds__(kBlock) make_leaves(GpuImport job, BuildState* state) {
  const std::uint32_t i = thread_index();
  if (i >= job.tree.leaf_count) return;
  const GpuImport::Named named = job.named(i);
  for (std::uint32_t k = 0; k < job.slots(); ++k) {
    Reference& leaf = job.leaves[job.slots() * i + k];
    leaf = Reference{empty_box(), LeafContents::none(), 0};
    const std::uint32_t number = named.exists ? named.reference[k] : kInvalidId;
    if (number == kInvalidId || !job.references[number].contents.exists()) continue;
    const Reference& whole = job.references[number];
    leaf = part_of(whole, job.part_box(i, whole, job.uses[number]));
    state->bounds.add(leaf.box);
    fetch_add(&state->counts.leaves, 1);
    if (whole.contents.is_custom()) fetch_add(&state->counts.customs, 1);
  }
  const LinkedRef link = job.link_of_leaf(i);
  if (link != kInvalidId && (link & kLinkedLeaf) == 0)
    job.nodes[link] = LinkedNode{empty_box(), {2 * i | kLinkedLeaf, (2 * i + 1) | kLinkedLeaf}};
}

/// Climbs from a leaf. Whoever comes second to a node knows what is below it.
static __global__ void __launch_bounds__(kBlock) splice(GpuImport job, BuildState* state) {
  const std::uint32_t i = thread_index(), leaves = job.tree.leaf_count;
  if (i >= leaves || state->bad_node != kInvalidId) return;
  LinkedRef link = job.link_of_leaf(i);
  std::uint32_t count = 1, child = i;
  bool leaf = true;
  for (std::uint32_t node = job.parents[leaves + i]; leaves != 1; node = job.parents[node]) {
    if (node == kInvalidId) return;  // Of a ring.
    const gpu::ImportedNode& from = job.tree.nodes[node];
    const unsigned side = from.child[0] == child && (from.is_leaf[0] == 1) == leaf ? 0 : 1;
    LinkedNode& linked = job.nodes[node + 1];
    store_shared(&linked.child[side], link);
    fetch_add(&job.below[node], count);
    if (fetch_add_ordered(&job.met[node], 1) == 0) return;
    const LinkedRef one = load_shared(&linked.child[0]), two = load_shared(&linked.child[1]);
    count = load_shared(&job.below[node]);
    link = one != kInvalidId && two != kInvalidId ? node + 1 : one != kInvalidId ? one : two;
    if (link != node + 1) linked.child[0] = linked.child[1] = kInvalidId;
    child = node;
    leaf = false;
    if (node == 0) break;
  }
  state->root = link;
  // Other leaves hang from a ring of nodes.
  if (count != leaves) lower(&state->bad_node, 0u);
}

static __global__ void __launch_bounds__(kBlock) drop_bad_tree(GpuImport job, BuildState* state) {
  const std::uint32_t i = thread_index();
  // Without a root nothing was climbed to: a ring of all nodes.
  const bool bad = state->bad_node != kInvalidId || (state->root == kInvalidId && state->counts.leaves != 0);
  if (!bad) return;
  if (i < job.capacity()) {
    job.nodes[i].child[0] = kInvalidId;
    job.leaves[i].contents = LeafContents::none();
  }
}

static __global__ void end_import(BuildState* state) {
  if (state->root == kInvalidId && state->counts.leaves != 0 && state->bad_node == kInvalidId) state->bad_node = 0;
  if (state->bad_node == kInvalidId) return;
  state->root = kInvalidId;
  state->counts.leaves = state->counts.customs = 0;
}

static __global__ void __launch_bounds__(kBlock)
    count_missing(GpuImport job, GeometryTable geometries, GeometryRecord* records, BuildState* state) {
  const std::uint32_t i = thread_index();
  if (i >= job.primitives || job.uses[i] != 0 || !job.references[i].contents.exists()) return;
  const std::uint32_t count = job.references[i].contents.is_pair() ? 2 : 1;
  fetch_add(&state->missing, count);
  atomicAdd(reinterpret_cast<unsigned long long*>(&records[geometries.find(i)].dropped_count),
            static_cast<unsigned long long>(count));
}

}  // namespace hiprt::build::kernels
