#include <hiprt_build/reinsert/reinsert.h>

#include <hiprt_build/reinsert/reinsert_rounds.h>
#include <hiprt_build/tree/flatten.h>
#include <hiprt_build/tree/link.h>

namespace hiprt::build {

DepthFirstTree reinsert(CpuEngine& engine, DepthFirstTree tree, unsigned rounds) {
  const std::size_t count = tree.references.size();
  if (count < 3 || rounds == 0) return tree;
  engine.monitor().start("reinsert", 0.73, tree.nodes.size() + count + count * 2 * rounds);
  auto nodes = engine.allocate<LinkedNode>(count);
  auto counts = engine.allocate<std::uint32_t>(count);
  auto parents = engine.allocate<std::uint32_t>(2 * count);
  const LinkNodeStep link{tree.nodes.span(), 0, nodes.span(), counts.span()};
  engine.for_each(tree.nodes.size(), link);
  LinkedRef root = link.ref(0);
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
