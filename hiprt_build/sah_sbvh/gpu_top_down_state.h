#pragma once
/// The state of a top-down build: ranges of references, level by level, in two arrays that alternate. The tree does not
/// depend on the order in which ranges and tasks are listed. Internal.

#include <hiprt_build/sah_sbvh/gpu_spatial_bins.h>

namespace hiprt::build::kernels {

inline constexpr unsigned kMostLevels = 64;

struct RangeBox {
  SharedBox box, centers;

  static constexpr unsigned kWords = 12;
  __device__ static bool is_low(unsigned word) { return word % 6 < 3; }
  __device__ std::uint32_t* words() { return box.low; }
};
static_assert(sizeof(RangeBox) == RangeBox::kWords * sizeof(std::uint32_t));

enum class SplitKind : std::uint32_t { kMedian, kObject, kSpatial };

/// @return BlockRange::crossing of a range. @param crossing the most references that a plane cuts.
inline __device__ float crossing_share(std::uint32_t crossing, std::uint32_t size) {
  return static_cast<float>(crossing) / static_cast<float>(size);
}
/// Whether planes may cut more references than there is room for. @param crossing as BlockRange::crossing.
inline __device__ bool cuts_too_many(float crossing, std::uint32_t size, std::uint32_t room) {
  return crossing * static_cast<float>(size) > static_cast<float>(room);
}

/// A range that blocks split: [begin, end). Spatial splits may extend it up to limit. A large range has several tasks,
/// which blocks share. A medium range is the work of one block.
struct BlockRange {
  RangeBox bounds;
  std::uint32_t begin, end, limit;
  std::uint32_t depth;       ///< Its references are in array depth % 2.
  std::uint32_t link;        ///< Where its node reference is stored: see TopDownTree::set().
  std::uint32_t first_task;  ///< Of a large range, whose tasks follow each other.
  // The split of the range.
  SplitKind kind;
  std::uint32_t tries_spatial;
  float crossing;         ///< As Range::crossing of sbvh.cpp.
  std::uint32_t counted;  ///< Whether bin_objects() counted the references of its slabs.
  SlabGroups groups;
  ObjectSplit split;
  SpatialSplitRecord spatial;
  // Its halves.
  std::uint32_t half;         ///< Index of the first reference of the right half, for SplitKind::kMedian.
  std::uint32_t right_begin;  ///< Index of the right half's first reference after the split; also the node's number.
  std::uint32_t child[2];     ///< Of a large range: for TopDownTree::range(); kInvalidId: a small range.

  __device__ std::uint32_t size() const { return end - begin; }
  __device__ bool is_crowded() const { return cuts_too_many(crossing, size(), limit - end); }
};

/// A part of a large range: references [begin, begin + task).
struct LargeTask {
  std::uint32_t range, begin;
};
/// The number of references of a task on each side of the object split and of the spatial split. Later: the sums over
/// the earlier tasks of its range.
struct TaskCounts {
  std::uint32_t object_left, spatial_left, spatial_right;
};

/// A range that is small enough for one group of lanes.
struct SmallRange {
  std::uint32_t begin, end, limit, link;
  std::uint32_t state;  ///< Depth, crossing, and flags.
  float cost;           ///< With kTrySpatial: cost of the best object split.

  static constexpr std::uint32_t kOther = 0x80000000u;       ///< Its references are in the second array.
  static constexpr std::uint32_t kTrySpatial = 0x40000000u;  ///< Halves overlap: a spatial split may be cheaper.
  static constexpr std::uint32_t kNoSpatial = 0x20000000u;   ///< No spatial split is cheaper.

  /// @param crossing as BlockRange::crossing, 0 to 1; it is kept in steps of 1/255, rounded up.
  __device__ static std::uint32_t pack(unsigned depth, std::uint32_t flags, float crossing) {
    return flags | static_cast<std::uint32_t>(fminf(ceilf(crossing * 255.0f), 255.0f)) << 8 | depth;
  }
  __device__ std::uint32_t size() const { return end - begin; }
  __device__ unsigned depth() const { return state & 0xffu; }
  __device__ float crossing() const { return static_cast<float>(state >> 8 & 0xffu) / 255.0f; }
  __device__ bool is_crowded() const { return cuts_too_many(crossing(), size(), limit - end); }
  __device__ bool is(std::uint32_t flag) const { return (state & flag) != 0; }
};
static_assert(kMaxDepth < 256);

struct TopDownState {
  RangeBox bounds;
  std::uint32_t count, limit;                                     ///< References, and the most after spatial splits.
  std::uint32_t ranges[kMostLevels + 1], tasks[kMostLevels + 1];  ///< Large ones by level.
  std::uint32_t medium_ranges, small_ranges;
  // What is 0 when a slice begins.
  std::uint32_t medium_ticket, ticket;
  // Of SharedRanges.
  std::uint32_t shared, shared_ticket;  ///< Ranges that groups gave away; that groups wait for or took.
  std::uint32_t waiting;                ///< Groups.
  std::uint32_t unfinished;             ///< Ranges given away - ranges finished, small ones included; modulo 2^32.
};

/// A part of a list that one launch processes.
struct Slice {
  std::uint32_t number, count;  ///< Of equal parts.

  __device__ std::uint32_t begin(std::uint32_t size) const {
    return static_cast<std::uint32_t>(std::uint64_t{size} * number / count);
  }
  __device__ std::uint32_t end(std::uint32_t size) const { return Slice{number + 1, count}.begin(size); }
};

/// The value of unused entries of the output.
inline __device__ Reference no_reference() { return Reference{empty_box(), LeafContents::none(), kInvalidId}; }

/// Of a large range.
/// @param whole whether splits that cut nothing are tried.
constexpr std::uint32_t bin_words(bool whole) {
  return ObjectBins::kSize + SlabBins::kSize + (whole ? WholeSlabs::kSize : 0);
}

/// @return whether ranges must be split at the median from here on, to limit the depth.
inline __device__ bool is_deep(unsigned depth, std::uint32_t places) {
  return depth + static_cast<unsigned>(std::bit_width(places)) >= kMaxDepth;
}

/// Everything that does not change during a build.
struct TopDownTree {
  GeometryTable geometries;
  Reference* references[2];  ///< [capacity]. The second is the output.
  LinkedNode* nodes;
  LinkedRef* root;
  std::uint32_t* leaves;
  TopDownState* state;
  BlockRange* ranges[2];  ///< Large ones, by the parity of their level.
  LargeTask* tasks[2];
  TaskCounts* counts;
  std::uint32_t* bins;  ///< ObjectBins, SlabBins and WholeSlabs of the large ranges of a level: bin_words() for each.
  BlockRange* medium_ranges;
  SmallRange* small_ranges;
  std::uint32_t* shared_ranges;  ///< [most_shared] Of SharedRanges.
  std::uint32_t most_shared;
  std::uint32_t capacity, task, wave_range, spare_levels;
  SplitRules rules;

  static constexpr std::uint32_t kMedium = 0x80000000u;  ///< In numbers of ranges.

  /// @param link node * 2 + side; kInvalidId for the root.
  __device__ void set(std::uint32_t link, LinkedRef ref) const {
    *(link == kInvalidId ? root : &nodes[link / 2].child[link % 2]) = ref;
  }
  __device__ void set_leaf(std::uint32_t link, std::uint32_t begin, std::uint32_t limit,
                           const Reference& reference) const {
    references[1][begin] = reference;
    for (std::uint32_t i = begin + 1; i < limit; ++i) references[1][i] = no_reference();
    set(link, begin | kLinkedLeaf);
  }
  /// @param number in its list, with kMedium if that is the list of medium ranges; not kInvalidId.
  __device__ BlockRange& range(unsigned level, std::uint32_t number) const {
    return (number & kMedium) != 0 ? medium_ranges[number & ~kMedium] : ranges[level % 2][number];
  }
  /// @param number of a large range.
  __device__ ObjectBins object_bins(std::uint32_t number) const {
    return ObjectBins{bins + std::size_t{number} * bin_words(tries_whole())};
  }
  __device__ SlabBins slab_bins(std::uint32_t number) const {
    return SlabBins{object_bins(number).words + ObjectBins::kSize};
  }
  /// @param used whether splits that cut nothing are tried for the range.
  __device__ WholeSlabs whole_slabs(std::uint32_t number, bool used) const {
    return WholeSlabs{slab_bins(number).words + SlabBins::kSize, used};
  }
  /// Whether splits that cut nothing are tried. Not in crowded ranges: what they cost is most of the time there.
  __device__ bool tries_whole() const { return rules.whole_share != 0.0f; }
  /// Whether a range lies so deep, or so much deeper than in a balanced tree, that it is halved by count.
  __device__ bool is_late(const BlockRange& range) const {
    return is_deep(range.depth, range.limit - range.begin) ||
           range.depth >= spare_levels + static_cast<unsigned>(std::bit_width((state->limit - 1) / range.size()));
  }
  __device__ float least_overlap() const { return rules.least_overlap * half_area(state->bounds.box.get()); }
};

/// The halves of a range. The left half keeps its part of the free capacity; the right half begins behind it.
struct Halves {
  std::uint32_t left_end, right_begin, right_end;

  /// @param left_area, right_area half the areas of their boxes; 0 and 0 share the capacity by the counts alone.
  __device__ Halves(std::uint32_t begin, std::uint32_t limit, std::uint32_t left_count, std::uint32_t right_count,
                    float left_area, float right_area) {
    const std::uint32_t capacity = limit - begin - left_count - right_count;
    left_end = begin + left_count;
    right_begin = left_end;
    if (capacity != 0)
      right_begin +=
          static_cast<std::uint32_t>(left_capacity(capacity, {left_count, left_area}, {right_count, right_area}));
    right_end = right_begin + right_count;
  }
};

}  // namespace hiprt::build::kernels
