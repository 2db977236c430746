#include <hiprt_build/sah_sbvh/gpu_top_down.h>

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/sah_sbvh/gpu_compact_references.h>
#include <hiprt_build/sah_sbvh/gpu_medium_ranges.h>
#include <hiprt_build/sah_sbvh/gpu_top_down_kernels.h>
#include <hiprt_build/sah_sbvh/gpu_top_down_small.h>

#include <algorithm>
#include <bit>

namespace hiprt::gpu {
namespace {

using namespace build::kernels;
using build::Reference;

/// References of the input that a block packs.
constexpr std::uint32_t kPiece = 2048;

/// References of a range cost so many times as much below the levels of large ranges as in one of them.
constexpr std::uint32_t kWorkBelowLevels = 8;
/// Shares of the levels, and of them and medium ranges, in a build, roughly.
constexpr double kLevelsPart = 0.4, kMediumPart = 0.6;

/// How much of everything there can be.
struct Limits {
  std::uint32_t pieces, large_ranges, tasks, medium_ranges, small_ranges;
  unsigned spare_levels, levels;  ///< Levels of large ranges.

  Limits(std::uint32_t input, std::uint32_t capacity, const TopDownTuning& tuning) {
    const std::uint32_t leaves = std::max(capacity, 1u), wave_range = tuning.wave_range;
    const std::uint32_t block_range = std::max(tuning.task, wave_range);
    pieces = input == 0 ? 1 : (input - 1) / kPiece + 1;
    // Ranges of a level share the leaves. So do medium ranges.
    large_ranges = input <= block_range ? 0 : leaves / (block_range + 1);
    medium_ranges = input <= wave_range ? 0 : leaves / (wave_range + 1);
    tasks = large_ranges == 0 ? 0 : leaves / tuning.task + large_ranges;
    // A range is at most a level deeper than TopDownTree::is_late() says, because halves are rounded.
    const auto depth_of = [&](std::uint32_t size) {
      return spare_levels + static_cast<unsigned>(std::bit_width((leaves - 1) / size)) + 1;
    };
    spare_levels = std::min(tuning.spare_levels, kMostLevels / 2);
    levels = large_ranges == 0 ? 0 : depth_of(block_range) + 1;
    // Every split of a range that is not small makes one range more.
    const std::uint64_t splits = std::uint64_t{depth_of(wave_range) + 1} * medium_ranges;
    small_ranges = static_cast<std::uint32_t>(std::min<std::uint64_t>(leaves, splits + 1));
  }
};

/// Where everything is.
struct Memory {
  TopDownTree tree{};
  std::uint32_t* piece_counts;
  std::uint64_t size;

  Memory(std::byte* scratch, const Limits& limits, std::uint32_t capacity, const build::SplitRules& rules) {
    Arena arena(scratch);
    tree.references[0] = arena.take<Reference>(capacity);
    tree.state = arena.take<TopDownState>(1);
    piece_counts = arena.take<std::uint32_t>(limits.pieces);
    for (unsigned i = 0; i < 2; ++i) {
      tree.ranges[i] = arena.take<BlockRange>(limits.large_ranges);
      tree.tasks[i] = arena.take<LargeTask>(limits.tasks);
    }
    tree.counts = arena.take<TaskCounts>(limits.tasks);
    tree.bins = arena.take<std::uint32_t>(std::uint64_t{limits.large_ranges} * bin_words(rules.whole_share != 0.0f));
    tree.medium_ranges = arena.take<BlockRange>(limits.medium_ranges);
    tree.small_ranges = arena.take<SmallRange>(limits.small_ranges);
    tree.most_shared = std::min(SharedRanges::kMost, limits.small_ranges);
    tree.shared_ranges = arena.take<std::uint32_t>(tree.most_shared);
    size = arena.size();
  }
};

/// A build on its kind into a stream.
class Enqueuer {
 public:
  Enqueuer(const TopDownInput& input, const TopDownOutput& output, std::byte* scratch, hipStream_t stream,
           const TopDownTuning& tuning)
      : input_(input),
        limits_(input.input, input.capacity, tuning),
        memory_(scratch, limits_, input.capacity, input.splits),
        tree_(memory_.tree),
        steps_(stream),
        spatial_(input.spatial_splits && input.budget > 1.0) {
    tree_.geometries = input.geometries;
    tree_.references[1] = output.references;
    tree_.nodes = output.nodes;
    tree_.root = output.root;
    tree_.leaves = output.leaves;
    tree_.capacity = input.capacity;
    tree_.task = tuning.task;
    tree_.wave_range = tuning.wave_range;
    tree_.spare_levels = limits_.spare_levels;
    tree_.rules = input.splits;
  }

  Result<void> run(LongStep asks) {
    steps_.fill_bytes("the state", tree_.state, 1, 0);
    steps_.fill_bytes("the nodes", tree_.nodes, input_.capacity, 0xff);
    steps_.fill_bytes("the shared ranges", tree_.shared_ranges, tree_.most_shared, 0xff);
    compact();
    for (unsigned level = 0; level < limits_.levels; ++level) {
      split(level);
      steps_.then(
          [&] { return asks.done(steps_.stream(), input_.input, kLevelsPart * (level + 1.0) / limits_.levels); });
    }
    if (spatial_)
      build_below_levels<true>(asks);
    else
      build_below_levels<false>(asks);
    return steps_.result();
  }

 private:
  static std::uint32_t groups(std::uint32_t count) { return (count - 1) / kGroupsPerBlock + 1; }

  void compact() {
    const Reference* from = input_.references;
    std::uint32_t* counts = memory_.piece_counts;
    steps_.blocks("count_references", kTaskBlock, limits_.pieces, count_references, from, input_.input, kPiece, counts);
    steps_.blocks("begin_ranges", build::WaveGroup::kLanes, 1, begin_ranges, tree_, counts, limits_.pieces,
                  spatial_ ? input_.budget : 1.0);
    steps_.blocks("compact_references", kTaskBlock, limits_.pieces, compact_references, tree_, from, input_.input,
                  kPiece, counts);
  }

  void split(unsigned level) {
    const std::uint32_t tasks = limits_.tasks, range_groups = groups(limits_.large_ranges);
    if (spatial_) {
      steps_.persistent("bin_objects", kTaskBlock, tasks, bin_objects<true>, tree_, level);
      steps_.persistent("choose_splits", kGroupBlock, range_groups, choose_splits<true>, tree_, level);
      steps_.persistent("bin_spatial", kTaskBlock, tasks, bin_spatial, tree_, level);
      steps_.persistent("choose_spatial_splits", kGroupBlock, range_groups, choose_spatial_splits, tree_, level);
    } else {
      steps_.persistent("bin_objects", kTaskBlock, tasks, bin_objects<false>, tree_, level);
      steps_.persistent("choose_splits", kGroupBlock, range_groups, choose_splits<false>, tree_, level);
    }
    steps_.persistent("count_sides", kTaskBlock, tasks, count_sides, tree_, level);
    steps_.persistent("partition_ranges", kGroupBlock, range_groups, partition_ranges, tree_, level);
    steps_.persistent("scatter_references", kTaskBlock, tasks, scatter_references, tree_, level);
  }

  /// launches(slice) for slices of the lists: several if somebody is asked, because one launch may take long.
  /// @param begin, end of this part of the build.
  template <class Launches> void in_slices(LongStep& asks, double begin, double end, const Launches& launches) {
    const std::uint64_t work = std::uint64_t{input_.capacity} * kWorkBelowLevels;
    const std::uint32_t count = asks.parts(work);
    for (std::uint32_t i = 0; i < count; ++i) {
      launches(Slice{i, count});
      const double done = begin + (end - begin) * (i + 1.0) / (count + 1.0);
      steps_.then([&] { return asks.done(steps_.stream(), work / count, done); });
    }
  }

  template <bool kSpatialSplits> void build_below_levels(LongStep& asks) {
    TopDownState* const state = tree_.state;
    if (limits_.medium_ranges != 0)
      in_slices(asks, kLevelsPart, kMediumPart, [&](const Slice& slice) {
        if (slice.number != 0) steps_.fill_bytes("the ticket", &state->medium_ticket, 1, 0);
        steps_.persistent("build_medium", kTaskBlock, limits_.medium_ranges, build_medium<kSpatialSplits>, tree_,
                          slice);
      });
    in_slices(asks, kMediumPart, 1.0, [&](const Slice& slice) {
      if (slice.number != 0) {
        steps_.fill_bytes("the ticket", &state->ticket, 1, 0);
        steps_.fill_bytes("the counts of shared ranges", &state->shared, SharedRanges::kCounts, 0);
        steps_.fill_bytes("the shared ranges", tree_.shared_ranges, tree_.most_shared, 0xff);
      }
      steps_.persistent("build_small", kGroupBlock, groups(limits_.small_ranges), build_small<kSpatialSplits>, tree_,
                        slice);
    });
  }

  const TopDownInput& input_;
  Limits limits_;
  Memory memory_;
  TopDownTree& tree_;
  Launcher steps_;
  bool spatial_;
};

}  // namespace

std::uint64_t top_down_scratch(std::uint32_t input, std::uint32_t capacity, const TopDownTuning& tuning,
                               const build::SplitRules& splits) {
  return Memory(nullptr, Limits(input, capacity, tuning), capacity, splits).size;
}

Result<void> enqueue_top_down(const TopDownInput& input, const TopDownOutput& output, std::byte* scratch,
                              hipStream_t stream, const TopDownTuning& tuning, LongStep asks) {
  return Enqueuer(input, output, scratch, stream, tuning).run(asks);
}

}  // namespace hiprt::gpu
