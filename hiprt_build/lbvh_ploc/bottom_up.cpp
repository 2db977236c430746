#include <hiprt_build/lbvh_ploc/bottom_up.h>

#include <hiprt_build/exec/lane_group.h>
#include <hiprt_build/exec/radix_sort.h>
#include <hiprt_build/lbvh_ploc/hploc.h>
#include <hiprt_build/lbvh_ploc/lbvh.h>
#include <hiprt_build/lbvh_ploc/morton.h>
#include <hiprt_build/lbvh_ploc/ploc.h>
#include <hiprt_build/sah_sbvh/sah_reduce.h>
#include <hiprt_build/tree/flatten.h>

namespace hiprt::build {
namespace {

using Tree = LinkedTree<ReferenceLeaves>;

/// References in the order of their Morton codes, and the levels of the boundaries between them.
struct Sorted {
  ScratchArray<Reference> references;
  ScratchArray<std::uint8_t> levels;
};

Sorted sort_by_code(CpuEngine& engine, ScratchArray<Reference> references, unsigned bits) {
  const std::size_t count = references.size();
  auto codes = engine.allocate<std::uint64_t>(count);
  auto order = engine.allocate<std::uint32_t>(count);
  const MortonGrid grid = MortonGrid::over(to_box(bound_references(engine, references.span()).centers), bits);
  engine.for_each(count, [&](std::size_t i) {
    codes[i] = grid.code(references[i].box);
    order[i] = static_cast<std::uint32_t>(i);
  });
  radix_sort(engine, codes.span(), order.span(), 3 * bits);
  Sorted sorted;
  sorted.references = engine.allocate<Reference>(count);
  sorted.levels = engine.allocate<std::uint8_t>(count);
  engine.for_each(count, [&](std::size_t i) {
    sorted.references[i] = references[order[i]];
    if (i + 1 < count) sorted.levels[i] = boundary_level(codes[i], codes[i + 1], static_cast<std::uint32_t>(i));
  });
  return sorted;
}

void emit_lbvh(CpuEngine& engine, const Tree& tree, const Sorted& sorted) {
  const std::size_t count = sorted.references.size();
  auto met = engine.allocate<std::uint32_t>(count);
  engine.fill(met.span(), kInvalidId);
  engine.for_each(count, LbvhStep<Tree>{tree, static_cast<std::uint32_t>(count), sorted.levels.data(), met.data()});
}

void emit_hploc(CpuEngine& engine, const Tree& tree, const Sorted& sorted, std::uint32_t radius) {
  using Climber = Hploc<HostGroup, Tree>;
  const std::size_t count = sorted.references.size();
  auto met = engine.allocate<std::uint32_t>(count);
  engine.fill(met.span(), kInvalidId);
  auto kept = engine.allocate<KeptCluster>(count);
  const Climber climber{tree, static_cast<std::uint32_t>(count), sorted.levels.data(), met.data(), kept.data(), radius};
  engine.for_each(count, [&](std::size_t i) {
    Climber::Shared shared;
    climber(HostGroup{}, shared, static_cast<std::uint32_t>(i));
  });
}

}  // namespace

DepthFirstTree build_bottom_up(CpuEngine& engine, Builder builder, ScratchArray<Reference> references,
                               unsigned ploc_radius) {
  const std::size_t count = references.size();
  if (count == 0) return DepthFirstTree{};
  engine.monitor().start("sort", 0.5, 2 * count);
  const Sorted sorted =
      sort_by_code(engine, std::move(references), builder == Builder::kLbvh30 ? kMortonBits30 : kMortonBits63);
  engine.monitor().start("join", 0.6, count);
  auto nodes = engine.allocate<LinkedNode>(count);
  auto counts = engine.allocate<std::uint32_t>(count);
  LinkedRef root = kLinkedLeaf;
  const Tree tree{{sorted.references.data()}, nodes.data(), {counts.data()}, &root};
  if (builder == Builder::kHploc)
    emit_hploc(engine, tree, sorted, ploc_radius);
  else if (builder == Builder::kPloc)
    emit_ploc(engine, tree, count, ploc_radius);
  else
    emit_lbvh(engine, tree, sorted);
  engine.monitor().start("order", 0.65, count);
  return flatten(engine, {sorted.references.span(), nodes.span(), counts.span(), root});
}

}  // namespace hiprt::build
