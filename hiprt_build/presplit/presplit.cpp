#include <hiprt_build/presplit/presplit.h>

#include <hiprt_build/input/references.h>
#include <hiprt_build/presplit/presplit_steps.h>
#include <hiprt_build/sah_sbvh/sah_reduce.h>

namespace hiprt::build {
namespace {

/// So many slots take a good part of a millisecond.
constexpr std::size_t kManySlots = 1u << 10;

/// PresplitStep's slots.
struct ReferenceParts {
  const GeometryTable& geometries;
  std::span<Reference> references;
  std::span<std::uint32_t> pending;

  Box box(std::uint32_t slot) const { return references[slot].box; }
  LeafCorners corners(std::uint32_t slot) const { return leaf_corners(geometries, references[slot]); }
  bool is_pair(std::uint32_t slot) const { return references[slot].contents.is_pair(); }
  void put(std::uint32_t slot, std::uint32_t from, const Box& box) const {
    references[slot] = part_of(references[from], box);
  }
  std::uint32_t splits(std::uint32_t slot) const { return pending[slot]; }
  void set_splits(std::uint32_t slot, std::uint32_t count) const { pending[slot] = count; }
};

class Presplitter {
 public:
  Presplitter(CpuEngine& engine, const GeometryTable& geometries, ScratchArray<Reference> references)
      : engine_(engine),
        geometries_(geometries),
        references_(std::move(references)),
        planes_(to_box(bound_references(engine, references_.span()).box)),
        weight_(engine.allocate<float>(references_.size())) {
    engine.for_each(references_.size(), [this](std::size_t i) {
      const Reference& reference = references_[i];
      weight_[i] =
          split_weight(planes_, reference.box, leaf_corners(geometries_, reference), reference.contents.is_pair());
    });
  }

  ScratchArray<Reference> run(std::size_t max_splits) {
    const float scale = find_scale(max_splits);
    std::vector<std::size_t> first(CpuEngine::chunk_count(references_.size()));
    engine_.for_chunks(references_.size(), [&](std::size_t chunk, std::size_t begin, std::size_t end) {
      std::size_t slots = 0;
      for (std::size_t i = begin; i < end; ++i) slots += split_count(weight_[i], scale) + 1;
      first[chunk] = slots;
    });
    const std::size_t slots = engine_.exclusive_scan(std::span<std::size_t>(first));
    auto parts = engine_.allocate<Reference>(slots);
    auto splits = engine_.allocate<std::uint32_t>(slots);
    const PresplitStep<ReferenceParts> step{planes_, {geometries_, parts.span(), splits.span()}};
    std::vector<std::size_t> used(first.size());
    engine_.for_chunks(references_.size(), [&](std::size_t chunk, std::size_t begin, std::size_t end) {
      std::size_t slot = first[chunk], made = 0;
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t next = slot + split_count(weight_[i], scale) + 1;
        made += split(step, references_[i], slot, next);
        slot = next;
      }
      used[chunk] = made;
    });
    const std::size_t made = engine_.exclusive_scan(std::span<std::size_t>(used));
    if (made == slots) return parts;
    return close_up(parts.span(), first, used, made);
  }

 private:
  /// Makes all splits of a reference, in slots [first, end). @return the number of its parts.
  std::size_t split(const PresplitStep<ReferenceParts>& step, const Reference& whole, std::size_t first,
                    std::size_t end) const {
    for (std::size_t slot = first; slot < end; ++slot) {
      step.parts.references[slot].contents = LeafContents::none();
      step.parts.pending[slot] = 0;
    }
    step.parts.references[first] = whole;
    step.parts.pending[first] = static_cast<std::uint32_t>(end - first - 1);
    std::size_t made = 0;
    for (std::size_t slot = first; slot < end; ++slot) {
      // Few large references can take most of the cuts.
      if ((slot - first) % kManySlots == kManySlots - 1) engine_.monitor().check();
      while (step(static_cast<std::uint32_t>(slot))) {
      }
      made += step.parts.references[slot].contents.exists() ? 1 : 0;
    }
    return made;
  }

  /// PresplitScratch stay empty where a box was too small to be split as often as was planned.
  ScratchArray<Reference> close_up(std::span<const Reference> parts, std::span<const std::size_t> first,
                                   std::span<const std::size_t> to, std::size_t made) const {
    auto result = engine_.allocate<Reference>(made);
    engine_.for_chunks(references_.size(), [&](std::size_t chunk, std::size_t, std::size_t) {
      const std::size_t end = chunk + 1 < first.size() ? first[chunk + 1] : parts.size();
      std::size_t at = to[chunk];
      for (std::size_t slot = first[chunk]; slot < end; ++slot) {
        if (slot % kManySlots == 0) engine_.monitor().check();
        if (parts[slot].contents.exists()) result[at++] = parts[slot];
      }
    });
    return result;
  }

  float find_scale(std::size_t max_splits) const {
    ScaleSearch search;
    while (!search.done()) {
      const float scale = search.next();
      const std::size_t total = Threads::reduce(
          references_.size(), CpuEngine::kChunk, std::size_t{0},
          [&](std::size_t begin, std::size_t end, std::size_t sum) {
            engine_.monitor().check();
            for (std::size_t i = begin; i < end; ++i) sum += split_count(weight_[i], scale);
            return sum;
          },
          std::plus<>{});
      search.tried(total <= max_splits);
    }
    return search.result();
  }

  CpuEngine& engine_;
  const GeometryTable& geometries_;
  ScratchArray<Reference> references_;
  SplitPlanes planes_;
  ScratchArray<float> weight_;
};

}  // namespace

ScratchArray<Reference> presplit(CpuEngine& engine, const GeometryTable& geometries, ScratchArray<Reference> references,
                                 double budget) {
  const std::size_t count = references.size(), most = split_capacity(count, budget);
  if (most <= count) return references;
  engine.monitor().start("split", 0.4, 4 * count);
  return Presplitter(engine, geometries, std::move(references)).run(most - count);
}

SplitDemand measure_demand(CpuEngine& engine, const GeometryTable& geometries, std::span<const LeafPrimitives> leaves) {
  const auto sum = [&](const auto& none, const auto& add) {
    return Threads::reduce(
        leaves.size(), CpuEngine::kChunk, none,
        [&](std::size_t begin, std::size_t end, auto so_far) {
          engine.monitor().check();
          for (std::size_t i = begin; i < end; ++i) add(so_far, leaves[i]);
          return so_far;
        },
        [](auto a, const auto& b) {
          a.add(b);
          return a;
        });
  };
  const SimdBox bounds =
      sum(SimdBox{}, [&](SimdBox& box, const LeafPrimitives& leaf) { box.add(leaf_simd_box(geometries, leaf)); });
  const float scene = half_area(to_box(bounds));
  return sum(SplitDemand{}, [&](SplitDemand& so_far, const LeafPrimitives& leaf) {
    so_far.add(SplitDemand::of(scene, to_box(leaf_simd_box(geometries, leaf)), leaf_corners(geometries, leaf),
                               leaf.contents.is_pair()));
  });
}

}  // namespace hiprt::build
