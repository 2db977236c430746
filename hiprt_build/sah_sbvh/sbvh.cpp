#include <hiprt_build/sah_sbvh/sbvh.h>

#include <hiprt_build/input/references.h>
#include <hiprt_build/sah_sbvh/sah_reduce.h>
#include <hiprt_build/sah_sbvh/spatial_bins.h>
#include <hiprt_build/tree/flatten.h>

#include <algorithm>
#include <bit>
#include <optional>

namespace hiprt::build {
namespace {

constexpr std::size_t kTaskSize = 1024;
/// So many references that cross all slabs take a wave_range milliseconds.
constexpr std::size_t kSlabChunk = 256;

/// References [begin, end), with capacity for spatial splits up to limit.
struct Range {
  std::size_t begin, end, limit;
  /// The largest share of references that a plane cuts, by the last count: of this range or of one above it.
  double crossing = 1.0;

  std::size_t size() const { return end - begin; }
  std::size_t capacity() const { return limit - end; }
  /// Whether no plane cuts more references than there is room for, as far as is known.
  bool has_room() const { return crossing * static_cast<double>(size()) <= static_cast<double>(capacity()); }
};

struct Halves {
  Range left, right;
};

class SbvhBuilder {
 public:
  SbvhBuilder(CpuEngine& engine, const GeometryTable& geometries, std::span<Reference> references,
              std::span<Reference> spare, std::span<LinkedNode> nodes, std::span<std::uint32_t> counts,
              const SplitRules& rules)
      : engine_(engine),
        geometries_(geometries),
        references_(references),
        spare_(spare),
        nodes_(nodes),
        counts_(counts),
        rules_(rules) {}

  LinkedRef build(std::size_t count) {
    const Range all{0, count, references_.size()};
    const RangeBounds bounds = bounds_of(all);
    least_overlap_ = rules_.least_overlap * half_area(bounds.box);
    return build(all, bounds, 0);
  }

 private:
  std::span<Reference> span_of(const Range& range) { return references_.subspan(range.begin, range.size()); }
  RangeBounds bounds_of(const Range& range) { return bound_references(engine_, span_of(range)); }

  /// A node is numbered by the place where its right half begins.
  LinkedRef build(Range range, const RangeBounds& bounds, unsigned depth) {
    join_parts(range);
    if (range.size() == 1) {
      engine_.monitor().add(1);
      return static_cast<LinkedRef>(range.begin) | kLinkedLeaf;
    }
    const Halves halves = split(range, bounds, depth);
    const auto node = static_cast<std::uint32_t>(halves.right.begin);
    LinkedRef left = 0, right = 0;
    const auto build_left = [&] { left = build(halves.left, bounds_of(halves.left), depth + 1); };
    const auto build_right = [&] { right = build(halves.right, bounds_of(halves.right), depth + 1); };
    if (range.size() < kTaskSize) {
      build_left();
      build_right();
    } else {
      engine_.invoke(build_left, build_right);
    }
    nodes_[node] = LinkedNode{to_box(bounds.box), {left, right}};
    counts_[node] = count(left) + count(right);
    return node;
  }

  std::uint32_t count(LinkedRef ref) const { return (ref & kLinkedLeaf) != 0 ? 1 : counts_[ref]; }

  /// Two parts of one leaf need no node over them.
  void join_parts(Range& range) {
    if (range.size() != 2 || references_[range.begin].primitive != references_[range.begin + 1].primitive) return;
    SimdBox box = simd_box(references_[range.begin]);
    box.add(simd_box(references_[range.begin + 1]));
    references_[range.begin].box = to_box(box);
    --range.end;
  }

  /// Reorders, and cuts, the references of a range. Neither half is empty.
  Halves split(Range& range, const RangeBounds& bounds, unsigned depth) {
    const std::size_t count = range.size();
    if (depth + static_cast<unsigned>(std::bit_width(range.limit - range.begin)) >= kMaxDepth)
      return place(range, count / 2, bounds.box, bounds.box);
    if (count <= kSweepSize) return split_small(range, bounds);
    const BinMapping mapping(bounds.centers, count);
    const Bins bins = bin_references(engine_, span_of(range), mapping);
    const Split best = find_best_split(bins, mapping);
    std::size_t asked = 0;
    const auto goes_left = [&](const Reference& r) {
      if (++asked % CpuEngine::kChunk == 0) engine_.monitor().check();
      return mapping(simd_box(r))[static_cast<std::size_t>(best.axis)] < best.bin;
    };
    SimdBox left, right;
    for (int i = 0; i < mapping.bins && best.axis >= 0; ++i) (i < best.bin ? left : right).add(bins.box[best.axis][i]);
    if (best.axis < 0) left = right = bounds.box;
    if (const auto halves = try_spatial_split(range, bounds.box, left, right, best.cost)) return *halves;
    if (best.axis < 0) return place(range, count / 2, left, right);
    const auto all = span_of(range);
    const auto middle = std::partition(all.begin(), all.end(), goes_left);
    return place(range, static_cast<std::size_t>(middle - all.begin()), left, right);
  }

  Halves split_small(Range& range, const RangeBounds& bounds) {
    const auto all = span_of(range);
    const std::size_t swept = sweep_split(all), left_count = swept == 0 ? all.size() / 2 : swept;
    SimdBox left, right;
    for (std::size_t i = 0; i < all.size(); ++i) (i < left_count ? left : right).add(simd_box(all[i]));
    const float cost = side_cost(left, static_cast<std::uint32_t>(left_count)) +
                       side_cost(right, static_cast<std::uint32_t>(all.size() - left_count));
    if (const auto halves = try_spatial_split(range, bounds.box, left, right, cost)) return *halves;
    return place(range, left_count, left, right);
  }

  /// The first so many references are the left half; the right one moves behind the left one's share of the capacity.
  /// @param left, right boxes of the halves.
  Halves place(const Range& range, std::size_t left_count, const SimdBox& left, const SimdBox& right) {
    const std::size_t right_count = range.size() - left_count;
    const std::size_t share =
        left_capacity(range.capacity(), {left_count, half_area(left)}, {right_count, half_area(right)});
    const std::size_t left_end = range.begin + left_count, right_begin = left_end + share;
    for (std::size_t end = right_count; end > 0 && share > 0;) {
      const std::size_t begin = end - std::min(end, CpuEngine::kChunk);
      Reference* const from = &references_[left_end];
      std::move_backward(from + begin, from + end, from + share + end);
      end = begin;
      if (end > 0) engine_.monitor().check();
    }
    return Halves{{range.begin, left_end, right_begin, range.crossing},
                  {right_begin, right_begin + right_count, range.limit, range.crossing}};
  }

  /// Calls add(bins, reference, its slabs) for a range. @return their sum.
  template <class Bins, class Add> Bins sum_slabs(const Range& range, const SlabPlanes& planes, const Add& add) {
    return reduce_references(
        engine_, span_of(range), Bins{},
        [&](std::span<const Reference> part, Bins so_far) {
          std::size_t added = 0;
          for (const Reference& r : part) {
            if (++added % kSlabChunk == 0) engine_.monitor().check();
            SlabSpan spans[3];
            for (int axis = 0; axis < 3; ++axis) spans[axis] = planes.span(axis, r.box.min[axis], r.box.max[axis]);
            add(so_far, r, spans);
          }
          return so_far;
        },
        [](Bins a, const Bins& b) {
          a.add(b);
          return a;
        });
  }

  /// @tparam Bins SpatialBins or WholeBins.
  template <class Bins> Bins bin_slabs(Range& range, const SlabPlanes& planes) {
    const auto add = [&](SpatialBins& bins, const Reference& r, const SlabSpan(&spans)[3], const auto& groups) {
      bins.add(leaf_corners(geometries_, r), r.contents.is_pair(), simd_box(r), planes, spans, groups);
    };
    const auto size = static_cast<double>(range.size());
    const bool has_room = range.has_room();
    // Where planes cut more references than there is room for, counts come first.
    Bins bins = sum_slabs<Bins>(range, planes, [&](Bins& all, const Reference& r, const SlabSpan(&spans)[3]) {
      all.count(simd_box(r), spans);
      if (has_room) add(all, r, spans, SingleSlabs{});
    });
    range.crossing = static_cast<double>(bins.crossing()) / size;
    if (has_room) return bins;
    const SlabGroups groups = bins.groups(range.limit - range.begin);
    if (groups.has_planes())
      bins.SpatialBins::add(sum_slabs<SpatialBins>(
          range, planes,
          [&](SpatialBins& parts, const Reference& r, const SlabSpan(&spans)[3]) { add(parts, r, spans, groups); }));
    return bins;
  }

  /// Splits by a plane if the halves of the best split of references overlap, and that is cheaper.
  /// @param left,right,cost of the split of references.
  std::optional<Halves> try_spatial_split(Range& range, const SimdBox& box, const SimdBox& left, const SimdBox& right,
                                          float cost) {
    if (range.capacity() == 0 || range.size() < kLeastCutRange) return std::nullopt;
    const SimdBox overlap{max4(left.min, right.min), min4(left.max, right.max)};
    if (overlap.empty() || !halves_overlap(half_area(overlap), least_overlap_, half_area(box))) return std::nullopt;
    const SlabPlanes planes = SlabPlanes::over(box);
    const std::size_t most = range.limit - range.begin;
    // Where cuts are counted first, other splits would cost most of the time.
    SpatialSplit best = rules_.whole_share == 0.0f || !range.has_room()
                            ? bin_slabs<SpatialBins>(range, planes).best(planes, most)
                            : bin_slabs<WholeBins>(range, planes).best(planes, most, rules_.whole_share);
    if (!(best.cost < cost)) return std::nullopt;
    return cut(range, best);
  }

  /// @return none if all references end up on one side.
  std::optional<Halves> cut(const Range& range, SpatialSplit& split) {
    std::size_t left_end = range.begin, right_begin = range.limit;
    std::size_t seen = 0;
    for (const Reference& r : span_of(range)) {
      if (++seen % kSlabChunk == 0) engine_.monitor().check();
      const SplitSide side = side_of(split.crossing, split.plane, r.box.min[split.axis], r.box.max[split.axis]);
      if (side == SplitSide::kLeft) {
        spare_[left_end++] = r;
      } else if (side == SplitSide::kRight) {
        spare_[--right_begin] = r;
      } else {
        const SplitBounds parts = parts_of(r, split);
        if (!parts.left.empty()) spare_[left_end++] = part_of(r, to_box(parts.left));
        if (!parts.right.empty()) spare_[--right_begin] = part_of(r, to_box(parts.right));
      }
    }
    const std::size_t left_count = left_end - range.begin, right_count = range.limit - right_begin;
    if (left_count == 0 || right_count == 0) return std::nullopt;
    const std::span<const Reference> spare = spare_;
    engine_.copy(spare.subspan(range.begin, left_count), references_.subspan(range.begin, left_count));
    const std::size_t right_at = left_end + left_capacity(right_begin - left_end, {left_count, half_area(split.left)},
                                                          {right_count, half_area(split.right)});
    engine_.copy(spare.subspan(right_begin, right_count), references_.subspan(right_at, right_count));
    return Halves{{range.begin, left_end, right_at, range.crossing},
                  {right_at, right_at + right_count, range.limit, range.crossing}};
  }

  /// @return both parts of a reference that crosses the plane, or all of it on one side. Then the other side is empty,
  /// and the split counts one reference less there.
  SplitBounds parts_of(const Reference& r, SpatialSplit& split) const {
    const SimdBox whole = simd_box(r);
    switch (cheapest_side(split, whole)) {
      case SplitSide::kLeft:
        split.left.add(whole);
        --split.right_count;
        return SplitBounds{whole, SimdBox{}};
      case SplitSide::kRight:
        split.right.add(whole);
        --split.left_count;
        return SplitBounds{SimdBox{}, whole};
      case SplitSide::kBoth:
        break;
    }
    return split_bounds(geometries_, r, whole, split.axis, split.plane);
  }

  CpuEngine& engine_;
  const GeometryTable& geometries_;
  std::span<Reference> references_, spare_;
  std::span<LinkedNode> nodes_;
  std::span<std::uint32_t> counts_;
  SplitRules rules_;
  float least_overlap_ = 0.0f;
};

}  // namespace

DepthFirstTree build_sbvh(CpuEngine& engine, const GeometryTable& geometries, ScratchArray<Reference> references,
                          double split_budget, const SplitRules& rules) {
  const std::size_t count = references.size();
  if (count == 0) return DepthFirstTree{};
  const std::size_t capacity = split_capacity(count, split_budget);
  engine.monitor().start("split", 0.6, capacity);
  auto larger = engine.allocate<Reference>(capacity);
  engine.copy(std::as_const(references).span(), larger.span());
  references.release();
  auto nodes = engine.allocate<LinkedNode>(capacity);
  auto counts = engine.allocate<std::uint32_t>(capacity);
  LinkedRef root = 0;
  {
    auto spare = engine.allocate<Reference>(capacity);
    root =
        SbvhBuilder(engine, geometries, larger.span(), spare.span(), nodes.span(), counts.span(), rules).build(count);
  }
  engine.monitor().start("order", 0.65, count);
  return flatten(engine, {larger.span(), nodes.span(), counts.span(), root});
}

}  // namespace hiprt::build
