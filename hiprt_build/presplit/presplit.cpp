#include <hiprt_build/presplit/presplit.h>

#include <hiprt_build/input/references.h>
#include <hiprt_build/presplit/presplit_steps.h>
#include <hiprt_build/sah_sbvh/sah_reduce.h>

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

namespace hiprt::build {
namespace {

/// So many places take a good part of a millisecond.
constexpr std::size_t kManyPlaces = 1u << 10;

/// CutStep's places.
struct ReferenceParts {
  const GeometryTable& geometries;
  std::span<Reference> references;
  std::span<std::uint32_t> pending;

  Box box(std::uint32_t place) const { return references[place].box; }
  LeafCorners corners(std::uint32_t place) const { return leaf_corners(geometries, references[place]); }
  bool is_pair(std::uint32_t place) const { return references[place].contents.is_pair(); }
  void put(std::uint32_t place, std::uint32_t from, const Box& box) const {
    references[place] = part_of(references[from], box);
  }
  std::uint32_t cuts(std::uint32_t place) const { return pending[place]; }
  void set_cuts(std::uint32_t place, std::uint32_t count) const { pending[place] = count; }
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
          cut_weight(planes_, reference.box, leaf_corners(geometries_, reference), reference.contents.is_pair());
    });
  }

  ScratchArray<Reference> run(std::size_t most_cuts) {
    const float scale = find_scale(most_cuts);
    std::vector<std::size_t> first(CpuEngine::chunk_count(references_.size()));
    engine_.for_chunks(references_.size(), [&](std::size_t chunk, std::size_t begin, std::size_t end) {
      std::size_t places = 0;
      for (std::size_t i = begin; i < end; ++i) places += cut_count(weight_[i], scale) + 1;
      first[chunk] = places;
    });
    const std::size_t places = engine_.exclusive_scan(std::span<std::size_t>(first));
    auto parts = engine_.allocate<Reference>(places);
    auto cuts = engine_.allocate<std::uint32_t>(places);
    const CutStep<ReferenceParts> step{planes_, {geometries_, parts.span(), cuts.span()}};
    std::vector<std::size_t> used(first.size());
    engine_.for_chunks(references_.size(), [&](std::size_t chunk, std::size_t begin, std::size_t end) {
      std::size_t place = first[chunk], made = 0;
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t next = place + cut_count(weight_[i], scale) + 1;
        made += cut(step, references_[i], place, next);
        place = next;
      }
      used[chunk] = made;
    });
    const std::size_t made = engine_.exclusive_scan(std::span<std::size_t>(used));
    if (made == places) return parts;
    return close_up(parts.span(), first, used, made);
  }

 private:
  /// Makes all cuts of a reference, in places [first, end). @return the number of its parts.
  std::size_t cut(const CutStep<ReferenceParts>& step, const Reference& whole, std::size_t first,
                  std::size_t end) const {
    for (std::size_t place = first; place < end; ++place) {
      step.parts.references[place].contents = LeafContents::none();
      step.parts.pending[place] = 0;
    }
    step.parts.references[first] = whole;
    step.parts.pending[first] = static_cast<std::uint32_t>(end - first - 1);
    std::size_t made = 0;
    for (std::size_t place = first; place < end; ++place) {
      // Few large references can take most of the cuts.
      if ((place - first) % kManyPlaces == kManyPlaces - 1) engine_.monitor().check();
      while (step(static_cast<std::uint32_t>(place))) {
      }
      made += step.parts.references[place].contents.exists() ? 1 : 0;
    }
    return made;
  }

  /// Places stay empty where a box was too small to be cut as often as was planned.
  ScratchArray<Reference> close_up(std::span<const Reference> parts, std::span<const std::size_t> first,
                                   std::span<const std::size_t> to, std::size_t made) const {
    auto result = engine_.allocate<Reference>(made);
    engine_.for_chunks(references_.size(), [&](std::size_t chunk, std::size_t, std::size_t) {
      const std::size_t end = chunk + 1 < first.size() ? first[chunk + 1] : parts.size();
      std::size_t at = to[chunk];
      for (std::size_t place = first[chunk]; place < end; ++place) {
        if (place % kManyPlaces == 0) engine_.monitor().check();
        if (parts[place].contents.exists()) result[at++] = parts[place];
      }
    });
    return result;
  }

  float find_scale(std::size_t most_cuts) const {
    ScaleSearch search;
    while (!search.done()) {
      const float scale = search.next();
      const std::size_t total = tbb::parallel_reduce(
          tbb::blocked_range<std::size_t>(0, references_.size(), CpuEngine::kChunk), std::size_t{0},
          [&](const tbb::blocked_range<std::size_t>& range, std::size_t sum) {
            engine_.monitor().check();
            for (std::size_t i = range.begin(); i < range.end(); ++i) sum += cut_count(weight_[i], scale);
            return sum;
          },
          std::plus<>{});
      search.tried(total <= most_cuts);
    }
    return search.result();
  }

  CpuEngine& engine_;
  const GeometryTable& geometries_;
  ScratchArray<Reference> references_;
  CutPlanes planes_;
  ScratchArray<float> weight_;
};

}  // namespace

ScratchArray<Reference> presplit(CpuEngine& engine, const GeometryTable& geometries, ScratchArray<Reference> references,
                                 double budget) {
  const std::size_t count = references.size(), most = split_capacity(count, budget);
  if (most <= count) return references;
  engine.monitor().start("cut", 0.4, 4 * count);
  return Presplitter(engine, geometries, std::move(references)).run(most - count);
}

}  // namespace hiprt::build
