#include <hiprt_build/src/gpu_top_down.h>

#include <hiprt_build/gpu/launch.h>
#include <hiprt_build/src/gpu_places.h>
#include <hiprt_build/src/gpu_top_down_kernels.h>
#include <hiprt_build/src/gpu_top_down_pack.h>
#include <hiprt_build/src/gpu_top_down_small.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace hiprt::gpu {
namespace {

using namespace build::kernels;
using build::LeafReference;

/// References of the input that a block packs.
constexpr std::uint32_t kPiece = 2048;

/// How much of everything there can be.
struct Limits {
  std::uint32_t pieces, ranges, tasks, small_ranges;
  unsigned free_levels, levels;  ///< Below the free ones ranges are halved by count.

  Limits(std::uint32_t input, std::uint32_t room, const TopDownTuning& tuning) {
    const std::uint32_t few = tuning.few, places = std::max(room, 1u);
    pieces = input == 0 ? 1 : (input - 1) / kPiece + 1;
    // Ranges of a level share the places, and each has more than few.
    ranges = input <= few ? 0 : places / (few + 1);
    tasks = ranges == 0 ? 0 : places / tuning.task + ranges;
    const auto halvings = static_cast<unsigned>(std::bit_width((places - 1) / few));
    free_levels = ranges == 0 ? 0 : std::min(halvings + tuning.spare_levels, kMostLevels - halvings);
    levels = ranges == 0 ? 0 : free_levels + halvings;
    // Every split of a large range makes one range more.
    const std::uint64_t splits = std::uint64_t{levels} * ranges;
    small_ranges = static_cast<std::uint32_t>(std::min<std::uint64_t>(places, splits + 1));
  }
};

/// Where everything is.
struct Memory {
  TopDownTree tree{};
  std::uint32_t* piece_counts;
  std::uint64_t size;

  Memory(std::byte* scratch, const Limits& limits, std::uint32_t room) {
    Pieces pieces(scratch);
    tree.references[0] = pieces.take<LeafReference>(room);
    tree.state = pieces.take<TopDownState>(1);
    piece_counts = pieces.take<std::uint32_t>(limits.pieces);
    for (unsigned i = 0; i < 2; ++i) {
      tree.ranges[i] = pieces.take<LargeRange>(limits.ranges);
      tree.tasks[i] = pieces.take<LargeTask>(limits.tasks);
    }
    tree.counts = pieces.take<TaskCounts>(limits.tasks);
    tree.bins = pieces.take<std::uint32_t>(std::uint64_t{limits.ranges} * ObjectBins::kSize);
    tree.small_ranges = pieces.take<SmallRange>(limits.small_ranges);
    size = pieces.size();
  }
};

/// A build on its way into a stream. Each step gives the error of the one before it.
class Enqueuer {
 public:
  Enqueuer(const TopDownInput& input, const TopDownOutput& output, std::byte* scratch, hipStream_t stream,
           const TopDownTuning& tuning)
      : input_(input),
        limits_(input.input, input.room, tuning),
        memory_(scratch, limits_, input.room),
        tree_(memory_.tree),
        stream_(stream),
        cuts_(input.cut && input.budget > 1.0) {
    tree_.soup = input.soup;
    tree_.references[1] = output.references;
    tree_.nodes = output.nodes;
    tree_.root = output.root;
    tree_.leaves = output.leaves;
    tree_.room = input.room;
    tree_.task = tuning.task;
    tree_.few = tuning.few;
  }

  Result<void> run() {
    fill("the state", tree_.state, 0, sizeof(TopDownState));
    fill("the nodes", tree_.nodes, 0xff, std::size_t{input_.room} * sizeof(build::LinkedNode));
    pack();
    for (unsigned level = 0; level < limits_.levels; ++level) split(level);
    if (cuts_)
      persistent("build_small", kGroupBlock, groups(limits_.small_ranges), build_small<true>, tree_);
    else
      persistent("build_small", kGroupBlock, groups(limits_.small_ranges), build_small<false>, tree_);
    return result_;
  }

 private:
  static std::uint32_t groups(std::uint32_t count) { return (count - 1) / kGroupsPerBlock + 1; }

  void fill(const char* what, void* memory, int value, std::size_t bytes) {
    if (result_ && bytes != 0) result_ = check(hipMemsetAsync(memory, value, bytes, stream_), "hipMemsetAsync", what);
  }
  template <class... Parameters>
  void start(const char* name, unsigned block, std::uint32_t blocks, void (*kernel)(Parameters...),
             std::type_identity_t<Parameters>... arguments) {
    if (result_) result_ = launch(kernel, Grid{blocks}, stream_, {.block = block, .name = name}, arguments...);
  }
  /// Blocks that the device holds at once, or fewer that have enough to do.
  template <class... Parameters>
  void persistent(const char* name, unsigned block, std::uint32_t most_blocks, void (*kernel)(Parameters...),
                  std::type_identity_t<Parameters>... arguments) {
    if (result_) start(name, block, std::min(resident(kernel, block), most_blocks), kernel, arguments...);
  }
  /// Asked for once: a build starts its kernels for every level.
  template <class... Parameters> unsigned resident(void (*kernel)(Parameters...), unsigned block) {
    const auto* address = reinterpret_cast<const void*>(kernel);
    for (const auto& [known, blocks] : resident_)
      if (known == address) return blocks;
    const auto blocks = persistent_grid(kernel, block);
    if (!blocks) result_ = tl::unexpected(blocks.error());
    return resident_.emplace_back(address, blocks ? *blocks : 1u).second;
  }

  void pack() {
    const LeafReference* from = input_.references;
    std::uint32_t* counts = memory_.piece_counts;
    start("count_references", kTaskBlock, limits_.pieces, count_references, from, input_.input, kPiece, counts);
    start("begin_ranges", build::WaveGroup::kLanes, 1, begin_ranges, tree_, counts, limits_.pieces,
          cuts_ ? input_.budget : 1.0);
    start("pack_references", kTaskBlock, limits_.pieces, pack_references, tree_, from, input_.input, kPiece, counts);
  }

  void split(unsigned level) {
    const std::uint32_t tasks = limits_.tasks, range_groups = groups(limits_.ranges);
    if (level < limits_.free_levels) {
      persistent("bin_objects", kTaskBlock, tasks, bin_objects, tree_, level);
      if (cuts_) {
        persistent("choose_splits", kGroupBlock, range_groups, choose_splits<true>, tree_, level);
        persistent("bin_space", kTaskBlock, tasks, bin_space, tree_, level);
        persistent("choose_cuts", kGroupBlock, range_groups, choose_cuts, tree_, level);
      } else {
        persistent("choose_splits", kGroupBlock, range_groups, choose_splits<false>, tree_, level);
      }
      persistent("count_sides", kTaskBlock, tasks, count_sides, tree_, level);
    }
    persistent("part_ranges", kGroupBlock, range_groups, part_ranges, tree_, level);
    persistent("scatter_references", kTaskBlock, tasks, scatter_references, tree_, level);
  }

  const TopDownInput& input_;
  Limits limits_;
  Memory memory_;
  TopDownTree& tree_;
  hipStream_t stream_;
  bool cuts_;
  std::vector<std::pair<const void*, unsigned>> resident_;
  Result<void> result_{};
};

}  // namespace

std::uint64_t top_down_scratch(std::uint32_t input, std::uint32_t room, const TopDownTuning& tuning) {
  return Memory(nullptr, Limits(input, room, tuning), room).size;
}

Result<void> enqueue_top_down(const TopDownInput& input, const TopDownOutput& output, std::byte* scratch,
                              hipStream_t stream, const TopDownTuning& tuning) {
  return Enqueuer(input, output, scratch, stream, tuning).run();
}

}  // namespace hiprt::gpu
