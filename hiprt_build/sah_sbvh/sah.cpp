#include <hiprt_build/sah_sbvh/sah.h>
#include <hiprt_build/sah_sbvh/sah_reduce.h>

#include <bit>

namespace hiprt::build {
namespace {

constexpr std::size_t kTaskSize = 2048;

class SahBuilder {
 public:
  SahBuilder(CpuEngine& engine, std::span<Reference> references, std::span<Reference> spare,
             std::span<DepthFirstNode> nodes)
      : engine_(engine), references_(references), spare_(spare), nodes_(nodes) {}

  void build() { build(0, 0, references_.size(), bounds_of(0, references_.size()), 0); }

 private:
  std::span<Reference> range(std::size_t begin, std::size_t end) { return references_.subspan(begin, end - begin); }

  void build(std::size_t node, std::size_t begin, std::size_t end, const RangeBounds& bounds, unsigned depth) {
    const std::size_t count = end - begin;
    nodes_[node] = {to_box(bounds.box), static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(count)};
    if (count == 1) {
      engine_.monitor().add(1);
      return;
    }
    const std::size_t middle = split(begin, end, bounds, depth);
    const std::size_t left = node + 1, right = node + 2 * (middle - begin);
    const auto build_left = [&] { build(left, begin, middle, bounds_of(begin, middle), depth + 1); };
    const auto build_right = [&] { build(right, middle, end, bounds_of(middle, end), depth + 1); };
    if (count < kTaskSize) {
      build_left();
      build_right();
    } else {
      engine_.invoke(build_left, build_right);
    }
  }

  /// Reorders [begin, end). @return the first reference of the right side, strictly between.
  std::size_t split(std::size_t begin, std::size_t end, const RangeBounds& bounds, unsigned depth) {
    const std::size_t count = end - begin, half = begin + count / 2;
    if (count == 2) return half;
    if (depth + static_cast<unsigned>(std::bit_width(count)) >= kMaxDepth) return half;
    if (count <= kSweepSize) {
      const std::size_t left = sweep_split(range(begin, end));
      return left == 0 ? half : begin + left;
    }
    const BinMapping mapping(bounds.centers, count);
    const Split best = find_best_split(bin_references(engine_, range(begin, end), mapping), mapping);
    if (best.axis < 0) return half;
    return partition(begin, end, [&](const Reference& r) {
      return mapping(simd_box(r))[static_cast<std::size_t>(best.axis)] < best.bin;
    });
  }

  RangeBounds bounds_of(std::size_t begin, std::size_t end) { return bound_references(engine_, range(begin, end)); }

  template <class Predicate> std::size_t partition(std::size_t begin, std::size_t end, const Predicate& goes_left) {
    if (end - begin < kParallelSize) {
      const auto all = range(begin, end);
      return begin + static_cast<std::size_t>(std::partition(all.begin(), all.end(), goes_left) - all.begin());
    }
    return parallel_partition(begin, end, goes_left);
  }

  /// Stable: each chunk counts, then writes its references to their places in the spare array.
  template <class Predicate>
  std::size_t parallel_partition(std::size_t begin, std::size_t end, const Predicate& goes_left) {
    const auto all = range(begin, end);
    std::vector<std::size_t> left(CpuEngine::chunk_count(all.size()));
    engine_.for_quiet_chunks(all.size(), [&](std::size_t chunk, std::size_t from, std::size_t to) {
      left[chunk] = static_cast<std::size_t>(std::count_if(all.begin() + static_cast<std::ptrdiff_t>(from),
                                                           all.begin() + static_cast<std::ptrdiff_t>(to), goes_left));
    });
    const std::size_t left_count = engine_.exclusive_scan(std::span<std::size_t>(left));
    const auto target = spare_.subspan(begin, all.size());
    engine_.for_quiet_chunks(all.size(), [&](std::size_t chunk, std::size_t from, std::size_t to) {
      std::size_t left_at = left[chunk], right_at = left_count + from - left[chunk];
      for (std::size_t i = from; i < to; ++i) target[goes_left(all[i]) ? left_at++ : right_at++] = all[i];
    });
    engine_.copy(std::span<const Reference>(target), all);
    return begin + left_count;
  }

  CpuEngine& engine_;
  std::span<Reference> references_, spare_;
  std::span<DepthFirstNode> nodes_;
};

}  // namespace

DepthFirstTree build_sah(CpuEngine& engine, ScratchArray<Reference> references) {
  DepthFirstTree tree;
  const std::size_t count = references.size();
  if (count == 0) return tree;
  engine.monitor().start("split", 0.75, count);
  tree.nodes = engine.allocate<DepthFirstNode>(2 * count - 1);
  auto spare = engine.allocate<Reference>(count >= kParallelSize ? count : 0);
  build_sah(engine, references.span(), spare.span(), tree.nodes.span());
  tree.references = std::move(references);
  return tree;
}

void build_sah(CpuEngine& engine, std::span<Reference> references, std::span<Reference> spare,
               std::span<DepthFirstNode> nodes) {
  SahBuilder(engine, references, spare, nodes).build();
}

}  // namespace hiprt::build
