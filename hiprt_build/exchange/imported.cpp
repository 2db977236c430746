#include <hiprt_build/exchange/imported.h>

#include <hiprt_build/lbvh_ploc/cluster.h>
#include <hiprt_build/presplit/split_among_leaves.h>
#include <hiprt_build/sah_sbvh/sah.h>
#include <hiprt_build/sah_sbvh/sah_reduce.h>
#include <hiprt_build/tree/flatten.h>
#include <hiprt_build/tree/link.h>

#include <span>
#include <vector>

namespace hiprt::build {
namespace {

using Tree = LinkedTree<ReferenceLeaves>;

/// The subtree of a node without references.
constexpr Cluster kNothing{empty_box(), kInvalidRef, kInvalidId};

struct NodeBoxes {
  std::span<const ExchangeNode> nodes;
  const Box& operator()(std::uint32_t node) const { return nodes[node].box; }
};

/// References and their imported leaves.
struct AssignedReferences {
  ScratchArray<Reference> references;
  ScratchArray<std::uint32_t> leaf;
  std::size_t count = 0;  ///< The first so many.

  void add(const Reference& reference, std::uint32_t of_leaf) {
    references[count] = reference;
    leaf[count++] = of_leaf;
  }
};

/// Assigns references to imported leaves: whole, or in parts if several leaves share them.
AssignedReferences assign(CpuEngine& engine, const ExchangeBvh& tree, const CheckedTree& checked,
                          const GeometryTable& geometries, std::span<const Reference> whole) {
  // A leaf that several imported leaves share has an entry in checked.shared for each of them.
  const std::size_t most = whole.size() + checked.shared.size();
  AssignedReferences assigned;
  assigned.references = engine.allocate<Reference>(most);
  assigned.leaf = engine.allocate<std::uint32_t>(most);
  TriangleSplitter<NodeBoxes> splitter(geometries, NodeBoxes{tree.nodes});
  std::vector<std::uint32_t> leaves;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    if (i % CpuEngine::kChunk == 0) engine.monitor().add(CpuEngine::kChunk);
    const std::uint32_t home = checked.home[whole[i].primitive];
    if ((home & CheckedTree::kShared) == 0) {
      assigned.add(whole[i], home);
      continue;
    }
    leaves.clear();
    for (const SharedTriangle& shared : checked.leaves_of(home & ~CheckedTree::kShared)) leaves.push_back(shared.leaf);
    splitter(whole[i], leaves,
             [&](const Box& part, std::uint32_t leaf) { assigned.add(part_of(whole[i], part), leaf); });
  }
  return assigned;
}

/// References in the order of the imported nodes that hold them.
struct Sorted {
  ScratchArray<Reference> references;
  ScratchArray<std::uint32_t> first;  ///< Of each node; one more at the end.

  std::uint32_t count(std::size_t node) const { return first[node + 1] - first[node]; }
};

Sorted sort_by_leaf(CpuEngine& engine, std::size_t nodes, const AssignedReferences& assigned) {
  Sorted sorted;
  sorted.references = engine.allocate<Reference>(assigned.count);
  sorted.first = engine.allocate<std::uint32_t>(nodes + 1);
  engine.fill(sorted.first.span(), 0u);
  for (std::size_t i = 0; i < assigned.count; ++i) ++sorted.first[assigned.leaf[i]];
  engine.exclusive_scan(sorted.first.span());
  for (std::size_t i = 0; i < assigned.count; ++i)
    sorted.references[sorted.first[assigned.leaf[i]]++] = assigned.references[i];
  // The loop has moved every first to that of the next node.
  std::copy_backward(sorted.first.data(), sorted.first.data() + nodes, sorted.first.data() + nodes + 1);
  sorted.first[0] = 0;
  return sorted;
}

/// Step: the subtree over the references of imported node i.
struct BuildLeafStep {
  static constexpr std::size_t kChunk = 512;

  CpuEngine& engine;
  std::span<Reference> references, spare;
  std::span<const std::uint32_t> first;
  std::span<DepthFirstNode> parts;  ///< Two per reference.
  std::span<LinkedNode> nodes;
  std::span<std::uint32_t> counts;
  std::span<Cluster> clusters;

  void operator()(std::size_t i) const {
    const std::uint32_t begin = first[i], count = first[i + 1] - begin;
    clusters[i] = kNothing;
    if (count == 0) return;
    const auto part = parts.subspan(std::size_t{2} * begin, std::size_t{2} * count - 1);
    build_sah(engine, references.subspan(begin, count), spare.empty() ? spare : spare.subspan(begin, count), part);
    const LinkNodeStep link{part, begin, nodes, counts};
    for (std::size_t node = 0; node < part.size(); ++node) link(node);
    clusters[i] = Cluster{part[0].box, link.ref(0), begin};
  }
};

/// Joins the nearest two until one is left. Of nothing: kNothing.
Cluster join_nearest(const Tree& tree, std::span<Cluster> open) {
  for (; open.size() > 1; open = open.first(open.size() - 1)) {
    std::uint64_t best = ~std::uint64_t{0};
    unsigned first = 0, second = 1;
    for (unsigned i = 0; i < open.size(); ++i)
      for (unsigned j = i + 1; j < open.size(); ++j) {
        const std::uint64_t here = nearness(open[i].box, open[j].box, i, j);
        if (here < best) best = here, first = i, second = j;
      }
    const bool in_order = open[first].free < open[second].free;
    open[first] = join(tree, open[in_order ? first : second], open[in_order ? second : first]);
    std::copy(open.begin() + second + 1, open.end(), open.begin() + second);
  }
  return open.empty() ? kNothing : open[0];
}

/// From the leaves to the root. @return the root's subtree.
Cluster join_nodes(CpuEngine& engine, const ExchangeBvh& tree, std::span<const std::uint32_t> order, const Tree& linked,
                   std::span<Cluster> clusters) {
  engine.monitor().start("join", 0.6, order.size());
  for (std::size_t i = order.size(); i-- > 0;) {
    const ExchangeNode& node = tree.nodes[order[i]];
    if (i % CpuEngine::kChunk == 0) engine.monitor().add(CpuEngine::kChunk);
    if (node.children == 0) continue;
    Cluster children[kBranching];
    unsigned count = 0;
    for (const Cluster& child : clusters.subspan(node.first, node.children))
      if (child.ref != kInvalidRef) children[count++] = child;
    clusters[order[i]] = join_nearest(linked, std::span(children, count));
  }
  return clusters[0];
}

}  // namespace

DepthFirstTree build_imported(CpuEngine& engine, const ExchangeBvh& tree, const CheckedTree& checked,
                              const GeometryTable& geometries, ScratchArray<Reference> references) {
  const std::size_t imported = tree.nodes.size();
  if (references.size() == 0) return DepthFirstTree{};
  engine.monitor().start("split", 0.5, imported + 2 * references.size());
  Sorted sorted = sort_by_leaf(engine, imported, assign(engine, tree, checked, geometries, references.span()));
  references.release();
  const std::size_t count = sorted.references.size();
  std::size_t largest = 0;
  for (std::size_t i = 0; i < imported; ++i) largest = std::max<std::size_t>(largest, sorted.count(i));
  auto nodes = engine.allocate<LinkedNode>(count);
  auto counts = engine.allocate<std::uint32_t>(count);
  auto clusters = engine.allocate<Cluster>(imported);
  {
    auto parts = engine.allocate<DepthFirstNode>(2 * count);
    auto spare = engine.allocate<Reference>(largest >= kParallelSize ? count : 0);
    engine.for_each(imported, BuildLeafStep{engine, sorted.references.span(), spare.span(), sorted.first.span(),
                                            parts.span(), nodes.span(), counts.span(), clusters.span()});
  }
  LinkedRef root = 0;
  const Tree linked{{sorted.references.data()}, nodes.data(), {counts.data()}, &root};
  root = join_nodes(engine, tree, checked.order.span(), linked, clusters.span()).ref;
  engine.monitor().start("order", 0.65, count);
  return flatten(engine, {sorted.references.span(), nodes.span(), counts.span(), root});
}

}  // namespace hiprt::build
