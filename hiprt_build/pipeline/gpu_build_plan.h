#pragma once
/// Sizes and memory of a build on the device. Internal.

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/exec/gpu_sort.h>
#include <hiprt_build/gpu/build.h>
#include <hiprt_build/lbvh_ploc/hploc.h>
#include <hiprt_build/pair/gpu_edge_table.h>
#include <hiprt_build/pipeline/gpu_state.h>
#include <hiprt_build/sah_sbvh/gpu_compact_tree.h>
#include <hiprt_build/sah_sbvh/gpu_top_down.h>

#include <algorithm>
#include <span>

namespace hiprt::gpu {

/// A build's numbers, all known before it starts.
struct BuildPlan {
  std::uint32_t primitives = 0;
  std::size_t geometries = 0;
  std::uint32_t whole = 0;     ///< Capacity for leaves before anything is split: primitives, unless they are counted.
  std::uint32_t pieces = 0;    ///< Capacity for references after pre-splitting; whole without it.
  std::uint32_t slots = 0;     ///< Places that spatial splits use, with gaps; pieces without them.
  std::uint32_t capacity = 0;  ///< Capacity for leaves: slots, unless they are counted.
  std::uint32_t wide = 0;      ///< Capacity for nodes of the file: that of leaves, unless they are counted.
  std::uint32_t many_nodes = build::kernels::kManyNodes;  ///< A file of so many is written in another order.
  std::uint64_t unasked = kUnaskedWork;                   ///< As LongStep.
  build::Builder builder{};
  NodeLayout layout{};
  bool counted = false;                              ///< Whether `whole` is the number of leaves.
  bool pairs = false;                                ///< Whether leaves may hold two primitives.
  bool measures_demand = false;                      ///< Whether split_budget is only the least.
  double split_budget = 1.0, presplit_budget = 1.0;  ///< 1 where there are custom primitives.
  unsigned rounds = 0, radius = 0;
  bool usual_rounds = false;  ///< Whether the caller named no rounds.
  std::size_t sort_bytes = 0;
  std::uint32_t imported_leaves = 0;  ///< Of the caller's tree; 0: the builder makes one.

  bool imports() const { return imported_leaves != 0; }
  bool from_top() const {
    return builder == build::Builder::kSah || builder == build::Builder::kSbvh || builder == build::Builder::kHq;
  }
  TopDownTuning tuning() const { return TopDownTuning::of(std::max(primitives, pieces), split_budget > 1.0); }
  bool presplits() const { return pieces != whole; }
  /// Whether a primitive can be in several leaves.
  bool splits() const { return slots != whole || imports(); }
  bool leaves_gaps() const { return from_top() && slots != pieces; }
  /// Whether a tree with gaps comes first: where closing them pays. Reinsertion passes over all slots in each round.
  bool gapped() const { return leaves_gaps() && (rounds != 0 || counted); }
  /// Of the array that the tree is built from. Some may not exist.
  std::uint32_t references() const { return presplits() ? pieces : primitives; }
  /// Whether leaves are sorted along a Morton curve.
  bool sorts() const { return !from_top() && !imports(); }
  /// Whether only references that exist get a key.
  bool packs() const { return counted && !presplits(); }
  std::uint32_t keys() const { return packs() ? whole : references(); }
  /// Whether a pass over the whole tree makes its plans: where they do not come with its nodes.
  bool finishes() const { return rounds != 0 || from_top() || imports() || builder == build::Builder::kPloc; }
};

/// What is known of a build from its beginning to its end.
struct Head {
  build::kernels::BuildState* state = nullptr;
  build::GeometryView* geometries = nullptr;

  Head() = default;
  Head(Arena& arena, const BuildPlan& plan)
      : state(arena.take<build::kernels::BuildState>(1)),
        geometries(arena.take<build::GeometryView>(plan.geometries)) {}
};

/// The binary tree.
struct TreeMemory {
  build::LeafPrimitives* primitives = nullptr;
  build::LinkedNode* nodes = nullptr;
  build::CollapsePlan* plans = nullptr;
  build::Reference* leaves = nullptr;  ///< If their boxes are not those of their primitives.
  Box* leaf_boxes = nullptr;
  build::kernels::GridProgress* progress = nullptr;  ///< Of the file's nodes.
  /// Where nodes and plans will be, until the leaves are sorted.
  build::SortBuffers sort{};
  std::byte* sort_temp = nullptr;
  std::uint64_t* pack_words = nullptr;  ///< [pack_words()] Of pack_keys().

  TreeMemory() = default;
  TreeMemory(Arena& arena, const BuildPlan& plan);
};

/// What the making of the tree needs until it is complete.
struct TreeScratch {
  build::Reference* parts = nullptr;
  build::kernels::SortedLeaves sorted{};
  build::KeptCluster* kept = nullptr;
  std::byte* stage = nullptr;  ///< Of the stage that runs.

  TreeScratch() = default;
  /// @param tree whose arrays some of the leaves are.
  /// @param split, rest which of the two is made: a gapped tree (or the references for another), and the tree.
  TreeScratch(Arena& arena, const BuildPlan& plan, const TreeMemory& tree, bool split, bool rest);
};

/// Where everything is that is no file.
struct BuildMemory {
  Head head;
  build::Reference* references = nullptr;  ///< [primitives]
  EdgeTableScratch pairing{};              ///< Not used once there are leaves.
  GappedTree gapped{};                     ///< Of plans that need one.
  TreeMemory tree;
  TreeScratch scratch;
};

/// The file that is written, and the report on it.
struct BuildOutput {
  std::byte* base = nullptr;
  FileLayout file{};
  GeometryRecord* records = nullptr;  ///< Of the file or to be copied there.
  BuildReport* report = nullptr;
};

/// All sizes and offsets of a build in two pieces of memory, for the worst case. What is needed until the binary tree
/// is complete lies where the wide nodes and leaves will be, if they are large enough.
struct Layouts {
  BuildPlan plan;
  FileLayout file;
  std::uint64_t report, transient, kept;
  bool transient_in_output;

  explicit Layouts(const BuildPlan& build_plan);

  std::uint64_t transient_offset() const { return align_up(file[kNodesAt].offset, kDeviceAlignment); }
  BuildSizes sizes() const {
    return {report + align_up(sizeof(BuildReport), kDeviceAlignment), kept + (transient_in_output ? 0 : transient)};
  }
  BuildMemory memory(std::byte* output, std::byte* scratch) const;
  BuildOutput output(std::byte* base) const;
};

/// Sets the capacities for so many leaves before anything is split.
/// @param counted whether so many there are, not at most.
Result<void> plan_leaves(BuildPlan& plan, std::uint32_t leaves, bool counted);
/// Words that TileSums of pack_keys() needs: one per tile, and one for the number of tiles taken.
std::uint64_t pack_words(const BuildPlan& plan);

/// Of what is already checked. @param imported_leaves of a caller's tree over one geometry; 0: the builder makes the
/// tree.
Result<BuildPlan> plan_memory(std::span<const DeviceGeometry> geometries, const BuildOptions& options,
                              std::uint32_t imported_leaves = 0);

/// For the worst case. @return kTooLarge if a file could not address it.
Result<Layouts> plan_build(std::span<const DeviceGeometry> geometries, const BuildOptions& options,
                           std::uint32_t imported_leaves = 0);

}  // namespace hiprt::gpu
