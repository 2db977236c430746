#pragma once
/// Sizes and memory of a build on the device. Internal.

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/exec/gpu_sort.h>
#include <hiprt_build/gpu/build.h>
#include <hiprt_build/lbvh_ploc/hploc.h>
#include <hiprt_build/pair/gpu_edge_table.h>
#include <hiprt_build/pipeline/gpu_state.h>
#include <hiprt_build/sah_sbvh/gpu_top_down.h>

#include <span>

namespace hiprt::gpu {

/// A build's numbers, all known before it starts.
struct BuildPlan {
  std::uint32_t primitives = 0;
  std::size_t geometries = 0;
  std::uint32_t pieces = 0;    ///< Capacity for references after pre-splitting; primitives without it.
  std::uint32_t capacity = 0;  ///< Capacity for leaves: pieces, or more with spatial splits.
  build::Builder builder{};
  NodeLayout layout{};
  bool pairs = false;                                ///< Whether leaves may hold two primitives.
  double split_budget = 1.0, presplit_budget = 1.0;  ///< 1 where there are custom primitives.
  unsigned rounds = 0, radius = 0;
  std::size_t sort_bytes = 0;
  std::uint32_t imported_leaves = 0;  ///< Of the caller's tree; 0: the builder makes one.

  bool imports() const { return imported_leaves != 0; }
  bool from_top() const {
    return builder == build::Builder::kSah || builder == build::Builder::kSbvh || builder == build::Builder::kHq;
  }
  TopDownTuning tuning() const { return TopDownTuning::of(pieces, split_budget > 1.0); }
  bool presplits() const { return pieces != primitives; }
  /// Whether a primitive can be in several leaves.
  bool splits() const { return capacity != primitives || imports(); }
  /// Whether a pass over the whole tree makes its plans: where they do not come with its nodes.
  bool finishes() const { return rounds != 0 || from_top() || imports() || builder == build::Builder::kPloc; }
};

/// Memory that is needed until the binary tree is complete. It lies where the wide nodes and leaves will be, if they
/// are large enough.
struct Transient {
  build::Reference* references;
  EdgeTableScratch pairing{};  ///< Overlaps everything below, which is used after pairing.
  build::Reference* parts = nullptr;
  build::SortBuffers sort{};
  std::byte* sort_temp = nullptr;
  build::kernels::SortedLeaves sorted{};
  build::KeptCluster* kept = nullptr;
  /// Of the stage that runs.
  std::byte* stage = nullptr;

  Transient(Arena& arena, const BuildPlan& plan);
};

/// Memory that is needed until the wide tree is complete.
struct Kept {
  build::kernels::BuildState* state;
  build::GeometryView* geometries;
  build::LeafPrimitives* primitives;
  build::LinkedNode* nodes;
  build::CollapsePlan* plans;
  build::Reference* leaves = nullptr;  ///< If their boxes are not those of their primitives.
  Box* leaf_boxes = nullptr;

  Kept(Arena& arena, const BuildPlan& plan);
};

/// All sizes and offsets of a build.
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
};

/// @param imported_leaves of a caller's tree over one geometry; 0: the builder makes the tree.
Result<Layouts> plan_build(std::span<const DeviceGeometry> geometries, const BuildOptions& options,
                           std::uint32_t imported_leaves = 0);

}  // namespace hiprt::gpu
