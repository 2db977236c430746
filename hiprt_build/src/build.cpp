#include <hiprt_build/build.h>
#include <hiprt_build/builders/bottom_up.h>
#include <hiprt_build/builders/embree.h>
#include <hiprt_build/builders/optimize.h>
#include <hiprt_build/builders/sah.h>
#include <hiprt_build/builders/sbvh.h>
#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/src/build_on.h>
#include <hiprt_build/src/provenance.h>
#include <hiprt_build/steps/encode.h>
#include <hiprt_build/steps/presplit.h>
#include <hiprt_build/steps/references.h>
#include <hiprt_device/format/buffer.h>
#include <hiprt_device/format/quantize.h>

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <chrono>
#include <cmath>
#include <new>

namespace hiprt::build {
namespace {

/// Larger meshes have half-edge numbers beyond 32 bits; a file could not address their leaves either.
constexpr std::uint64_t kMaxMeshTriangles = std::uint64_t{1} << 30;
constexpr std::uint64_t kMaxMeshVertices = std::uint64_t{1} << 31;
static_assert(4 * (kMaxMeshTriangles - 2) + 2 < kInvalidId && 3 * (kMaxMeshTriangles - 1) < kInvalidId &&
              2 * (kMaxMeshVertices - 2) + 1 < kInvalidId);
/// References are numbered with 31 bits: a leaf's primitives in the primitive map with 32.
constexpr std::uint64_t kMaxPrimitives = std::uint64_t{1} << 31;
/// 64 lower the SAH cost of sponza by another 0.4 %, 256 no further (decision 0011).
constexpr unsigned kHqRounds = 32;
constexpr std::uint32_t kMaxStackBound = 3 * kMaxDepth;

Error invalid(std::string message) { return Error{ErrorCode::kInvalidInput, std::move(message)}; }

Result<void> check_options(const BuildOptions& options) {
  if (options.max_leaf_triangles < 1 || options.max_leaf_triangles > 64)
    return tl::unexpected(
        invalid("max_leaf_triangles is " + std::to_string(options.max_leaf_triangles) + ", allowed are 1 to 64"));
  if (!(options.split_budget >= 1.0 && options.split_budget <= 16.0))
    return tl::unexpected(invalid("split_budget is " + std::to_string(options.split_budget) + ", allowed are 1 to 16"));
  if (options.ploc_radius < 1 || options.ploc_radius > 128)
    return tl::unexpected(invalid("ploc_radius is " + std::to_string(options.ploc_radius) + ", allowed are 1 to 128"));
  if (options.reinsertion_rounds.value_or(0) > 1000)
    return tl::unexpected(
        invalid("reinsertion_rounds is " + std::to_string(*options.reinsertion_rounds) + ", allowed are 0 to 1000"));
  if (!(options.costs.box_node > 0.0f) || !(options.costs.leaf > 0.0f) || !(options.costs.custom > 0.0f))
    return tl::unexpected(invalid("SAH costs must be positive"));
  if (options.nodes < NodeLayout::kFloat || options.nodes > NodeLayout::kQuantized)
    return tl::unexpected(invalid("node layout " + std::to_string(static_cast<std::uint32_t>(options.nodes)) +
                                  " cannot be written; known are float, planes, half and quantized"));
  return {};
}

Result<void> check_sizes(const SceneInput& scene) {
  const auto too_large = [](std::string message) {
    return tl::unexpected(Error{ErrorCode::kTooLarge, std::move(message)});
  };
  const std::span<const TriangleMesh> meshes = scene.meshes;
  if (meshes.size() + scene.customs.size() > kMaxGeometries)
    return too_large(std::to_string(meshes.size() + scene.customs.size()) + " geometries, a file names at most " +
                     std::to_string(kMaxGeometries));
  std::uint64_t primitives = 0;
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    if (meshes[m].triangles.size() >= kMaxMeshTriangles)
      return too_large("mesh " + std::to_string(m) + " has " + std::to_string(meshes[m].triangles.size()) +
                       " triangles, the limit is " + std::to_string(kMaxMeshTriangles - 1));
    if (meshes[m].positions.size() >= kMaxMeshVertices)
      return too_large("mesh " + std::to_string(m) + " has " + std::to_string(meshes[m].positions.size()) +
                       " vertices, the limit is " + std::to_string(kMaxMeshVertices - 1));
    primitives += meshes[m].triangles.size();
  }
  for (const CustomGeometry& custom : scene.customs) primitives += custom.boxes.size();
  if (primitives >= kMaxPrimitives)
    return too_large(std::to_string(primitives) + (scene.customs.empty() ? " triangles" : " primitives") +
                     ", the limit is " + std::to_string(kMaxPrimitives - 1));
  return {};
}

/// @return the smallest i below n for which bad(i), or n.
template <class Bad> std::size_t find_first(CpuEngine& engine, std::size_t n, const Bad& bad) {
  std::atomic<std::size_t> first{n};
  engine.for_each(n, [&](std::size_t i) {
    if (!bad(i)) return;
    std::size_t there = first.load(std::memory_order_relaxed);
    while (i < there && !first.compare_exchange_weak(there, i, std::memory_order_relaxed)) {
    }
  });
  return first.load();
}

/// "mesh 3 (chair.obj), triangle 17: " or "custom geometry 0 (hair), primitive 4: "
std::string place(const PrimitiveSoup& soup, std::size_t geometry, std::size_t primitive) {
  const bool custom = geometry >= soup.meshes.size();
  const std::size_t index = custom ? geometry - soup.meshes.size() : geometry;
  const std::string_view name = custom ? soup.customs[index].name : soup.meshes[index].name;
  return (custom ? "custom geometry " : "mesh ") + std::to_string(index) +
         (name.empty() ? "" : " (" + std::string(name) + ")") + (custom ? ", primitive " : ", triangle ") +
         std::to_string(primitive) + ": ";
}

/// Finds the first index past the vertices.
Result<void> check_indices(CpuEngine& engine, const PrimitiveSoup& soup) {
  for (std::size_t m = 0; m < soup.meshes.size(); ++m) {
    const TriangleMesh& mesh = soup.meshes[m];
    const std::size_t i = find_first(engine, mesh.triangles.size(), [&](std::size_t t) {
      const Triangle& indices = mesh.triangles[t];
      return std::max({indices[0], indices[1], indices[2]}) >= mesh.positions.size();
    });
    if (i == mesh.triangles.size()) continue;
    const Triangle& t = mesh.triangles[i];
    return tl::unexpected(invalid(place(soup, m, i) + "index " + std::to_string(*std::max_element(t.begin(), t.end())) +
                                  ", but there are " + std::to_string(mesh.positions.size()) + " vertices"));
  }
  return {};
}

/// Finds the first coordinate that a quantized node cannot hold.
Result<void> check_quantizable(CpuEngine& engine, const PrimitiveSoup& soup, const GroupedPrimitives& grouped) {
  const std::size_t i = find_first(engine, grouped.count, [&](std::size_t g) {
    const Aabb box = grouped.groups[g].bounds(soup);
    bool good = true;
    for (int axis = 0; axis < 3; ++axis)
      good = good && box.min[axis] > -kQuantizedLimit && box.max[axis] < kQuantizedLimit;
    return !good;
  });
  if (i == grouped.count) return {};
  const PrimitiveGroup& group = grouped.groups[i];
  return tl::unexpected(invalid(place(soup, group.geometry, group.primitive[0]) +
                                "a coordinate of 2^126 (8.5e37) or more, which node layout quantized cannot hold; "
                                "float, planes and half can"));
}

class Stopwatch {
 public:
  /// Seconds since the last call or the construction.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<double>(now - std::exchange(last_, now)).count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

Result<BinaryTree> build_tree(CpuEngine& engine, Builder builder, const PrimitiveSoup& soup,
                              const GroupedPrimitives& grouped, const BuildOptions& options) {
  auto references = engine.allocate<Reference>(grouped.count);
  engine.for_each(grouped.count, MakeReferenceStep{soup, grouped.groups.span(), references.span()});
  switch (builder) {
    case Builder::kHq:
      if (grouped.custom_count == 0)
        references = presplit(engine, soup, grouped.groups.span(), std::move(references), options.split_budget);
      return build_bottom_up(engine, Builder::kHploc, std::move(references), options.ploc_radius);
    case Builder::kSbvh:
      return build_sbvh(engine, soup, grouped.groups.span(), std::move(references),
                        grouped.custom_count == 0 ? options.split_budget : 1.0);
    case Builder::kSah:
      return build_sah(engine, std::move(references));
    case Builder::kLbvh:
    case Builder::kLbvh30:
    case Builder::kPloc:
    case Builder::kHploc:
      return build_bottom_up(engine, builder, std::move(references), options.ploc_radius);
    default:
      return build_embree(engine, builder, soup, grouped, std::move(references), options.split_budget);
  }
}

/// Embree's builders fail on scenes whose tree would be too deep (triangle sizes over hundreds of powers of two); ours
/// does not.
Result<BinaryTree> build_tree_or_ours(CpuEngine& engine, Builder& builder, const PrimitiveSoup& soup,
                                      const GroupedPrimitives& grouped, const BuildOptions& options) {
  Result<BinaryTree> tree = build_tree(engine, builder, soup, grouped, options);
  if (tree || tree.error().code != ErrorCode::kBackend) return tree;
  builder = Builder::kSah;
  return build_tree(engine, builder, soup, grouped, options);
}

/// What is known once the primitives are grouped.
BuildStatistics count_input(const PrimitiveSoup& soup, const GroupedPrimitives& grouped, Builder builder) {
  BuildStatistics statistics;
  statistics.triangles = soup.first[soup.meshes.size()];
  statistics.customs = soup.size() - statistics.triangles;
  statistics.dropped_not_finite = grouped.dropped_not_finite;
  statistics.dropped_degenerate = grouped.dropped_degenerate;
  statistics.pairs = grouped.pairs;
  statistics.custom_pairs = grouped.custom_pairs;
  // What a custom primitive is in a part of its box nobody knows: they are not split.
  const bool may_split = grouped.custom_count == 0;
  statistics.builder = builder == Builder::kEmbreeHigh && !may_split ? Builder::kEmbreeMedium : builder;
  return statistics;
}

}  // namespace

Result<Bvh> build_on(CpuEngine& engine, const SceneInput& scene, const BuildOptions& options) {
  Stopwatch total, watch;
  const PrimitiveSoup soup(scene);
  if (auto indices = check_indices(engine, soup); !indices) return tl::unexpected(indices.error());
  const GroupedPrimitives grouped =
      group_primitives(engine, soup, options.pair_triangles && options.max_leaf_triangles > 1);
  // References and tree nodes are numbered with 32 bits: refused before there are any.
  if (auto leaves = check_addresses(options.nodes, 1, grouped.count); !leaves) return tl::unexpected(leaves.error());
  if (options.nodes == NodeLayout::kQuantized)
    if (auto coordinates = check_quantizable(engine, soup, grouped); !coordinates)
      return tl::unexpected(coordinates.error());
  Bvh bvh{{}, count_input(soup, grouped, options.builder)};
  BuildStatistics& statistics = bvh.statistics;
  statistics.pair_seconds = watch.lap();
  Result<BinaryTree> tree = build_tree_or_ours(engine, statistics.builder, soup, grouped, options);
  if (!tree) return tl::unexpected(tree.error());
  const unsigned rounds = options.reinsertion_rounds.value_or(statistics.builder == Builder::kHq ? kHqRounds : 0);
  tree = optimize(engine, std::move(*tree), rounds);
  statistics.tree_seconds = watch.lap();
  const WideTree wide(engine, *tree, grouped.groups.span(), options.costs, options.max_leaf_triangles);
  statistics.leaves = tree->references.size();
  statistics.nodes = tree->empty() || wide.is_run(0) ? 0 : wide.node_count(0);
  statistics.collapse_seconds = watch.lap();
  Result<Buffer> buffer =
      encode(engine, {soup, grouped, *tree, wide, options.nodes,
                      make_provenance(engine.monitor(), scene, options, rounds, statistics, wide.cost())});
  if (!buffer) return tl::unexpected(buffer.error());
  const std::uint32_t stack_bound = reinterpret_cast<const FileHeader*>(buffer->bytes().data())->stack_bound;
  if (stack_bound > kMaxStackBound)
    return tl::unexpected(Error{ErrorCode::kTooLarge, "the tree needs " + std::to_string(stack_bound) +
                                                          " stack entries, the limit is " +
                                                          std::to_string(kMaxStackBound)});
  bvh.buffer = std::move(*buffer);
  statistics.encode_seconds = watch.lap();
  statistics.total_seconds = total.lap();
  statistics.scratch_bytes_peak = engine.ledger().peak();
  return bvh;
}

const char* name(Builder builder) {
  switch (builder) {
    case Builder::kSah:
      return "sah";
    case Builder::kLbvh:
      return "lbvh";
    case Builder::kLbvh30:
      return "lbvh30";
    case Builder::kPloc:
      return "ploc";
    case Builder::kHploc:
      return "hploc";
    case Builder::kSbvh:
      return "sbvh";
    case Builder::kHq:
      return "hq";
    case Builder::kEmbreeLow:
      return "embree-low";
    case Builder::kEmbreeMedium:
      return "embree-medium";
    case Builder::kEmbreeHigh:
      return "embree-high";
  }
  return "unknown";
}

const char* name(Quality quality) {
  switch (quality) {
    case Quality::kFast:
      return "fast";
    case Quality::kBalanced:
      return "balanced";
    case Quality::kHigh:
      return "high";
  }
  return "unknown";
}

BuildOptions options_for(Quality quality) {
  switch (quality) {
    case Quality::kFast:
      return {.builder = Builder::kLbvh};
    case Quality::kBalanced:
      return {.builder = Builder::kHploc};
    case Quality::kHigh:
      return {.builder = Builder::kHq};
  }
  return {};
}

Result<Bvh> build(std::span<const TriangleMesh> meshes, const BuildOptions& options) {
  return build(SceneInput{meshes, {}}, options);
}

Result<Bvh> build(const SceneInput& scene, const BuildOptions& options) try {
  if (auto checked = check_options(options); !checked) return tl::unexpected(checked.error());
  if (auto checked = check_sizes(scene); !checked) return tl::unexpected(checked.error());
  Monitor monitor(options.progress);
  MemoryLedger ledger;
  CpuEngine engine(monitor, ledger);
  // More than the process may use would bring nothing but oneTBB's warning.
  const std::size_t most = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  tbb::task_arena arena(static_cast<int>(options.threads == 0 ? most : std::min<std::size_t>(options.threads, most)));
  return arena.execute([&] { return build_on(engine, scene, options); });
} catch (const Cancelled&) {
  return tl::unexpected(Error{ErrorCode::kCancelled, "the build was cancelled"});
} catch (const std::bad_alloc&) {
  return tl::unexpected(Error{ErrorCode::kOutOfMemory, "not enough memory for the build of " +
                                                           std::to_string(scene.meshes.size() + scene.customs.size()) +
                                                           " geometries"});
} catch (const std::exception& exception) {
  return tl::unexpected(Error{ErrorCode::kBackend, exception.what()});
}

}  // namespace hiprt::build
