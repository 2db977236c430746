#include <hiprt_build/build.h>
#include <hiprt_build/embree/embree.h>
#include <hiprt_build/encode/encode.h>
#include <hiprt_build/exchange/imported.h>
#include <hiprt_build/exec/run_cpu.h>
#include <hiprt_build/exec/stopwatch.h>
#include <hiprt_build/input/check_input.h>
#include <hiprt_build/input/check_options.h>
#include <hiprt_build/input/provenance.h>
#include <hiprt_build/input/references.h>
#include <hiprt_build/lbvh_ploc/bottom_up.h>
#include <hiprt_build/pipeline/build_on.h>
#include <hiprt_build/presplit/presplit.h>
#include <hiprt_build/reinsert/reinsert.h>
#include <hiprt_build/sah_sbvh/sah.h>
#include <hiprt_build/sah_sbvh/sbvh.h>
#include <hiprt_device/format/buffer.h>

namespace hiprt::build {
namespace {

/// These trace fastest of all trees that were tried (decision 0013). Of the rounds, 64 lower the SAH cost of sponza by
/// another 0.4 %, 256 no further (decision 0011).
constexpr double kHqSplitBudget = 3.0;
constexpr unsigned kHqRounds = 32;
constexpr std::uint32_t kMaxStackBound = 3 * kMaxDepth;

/// What is built: if there is an imported tree, from that.
struct Job {
  const SceneInput& scene;
  const BuildOptions& options;
  const ExchangeBvh* imported;
};

ScratchArray<Reference> make_references(CpuEngine& engine, const PrimitiveSoup& soup,
                                        const GroupedPrimitives& grouped) {
  auto references = engine.allocate<Reference>(grouped.count);
  engine.for_each(grouped.count, MakeReferenceStep{soup, grouped.groups.span(), references.span()});
  return references;
}

Result<BinaryTree> build_tree(CpuEngine& engine, Builder builder, const PrimitiveSoup& soup,
                              const GroupedPrimitives& grouped, const BuildOptions& options) {
  auto references = make_references(engine, soup, grouped);
  const double split_budget = grouped.custom_count == 0 ? *options.split_budget : 1.0;
  if (grouped.custom_count == 0)
    references = presplit(engine, soup, grouped.groups.span(), std::move(references), options.presplit_budget);
  switch (builder) {
    case Builder::kHq:
    case Builder::kSbvh:
      return build_sbvh(engine, soup, grouped.groups.span(), std::move(references), split_budget);
    case Builder::kSah:
      return build_sah(engine, std::move(references));
    case Builder::kLbvh:
    case Builder::kLbvh30:
    case Builder::kPloc:
    case Builder::kHploc:
      return build_bottom_up(engine, builder, std::move(references), options.ploc_radius);
    default:
      return build_embree(engine, builder, soup, grouped, std::move(references), split_budget);
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

/// With what the builder's name stands for where nothing else is said.
BuildOptions complete(BuildOptions options) {
  const bool hq = options.builder == Builder::kHq;
  options.split_budget = options.split_budget.value_or(hq ? kHqSplitBudget : kSplitBudget);
  options.reinsertion_rounds = options.reinsertion_rounds.value_or(hq ? kHqRounds : 0);
  return options;
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

/// Whether a file can hold the primitives.
Result<void> check_fits(CpuEngine& engine, const PrimitiveSoup& soup, const GroupedPrimitives& grouped,
                        NodeLayout layout) {
  // References and tree nodes are numbered with 32 bits: refused before there are any.
  if (auto leaves = check_addresses(layout, 1, grouped.count); !leaves) return leaves;
  return layout == NodeLayout::kQuantized ? check_quantizable(engine, soup, grouped) : Result<void>{};
}

/// Collapses and encodes a tree.
Result<Bvh> finish(CpuEngine& engine, const Job& job, const PrimitiveSoup& soup, const GroupedPrimitives& grouped,
                   const BinaryTree& tree, BuildStatistics statistics) {
  Stopwatch watch;
  const BuildOptions& options = job.options;
  const WideTree wide(engine, tree, grouped.groups.span(), options.costs, options.max_leaf_triangles);
  statistics.leaves = tree.references.size();
  statistics.nodes = tree.empty() || wide.is_run(0) ? 0 : wide.node_count(0);
  statistics.collapse_seconds = watch.lap();
  Result<Buffer> buffer =
      encode(engine, {soup, grouped, tree, wide, options.nodes,
                      make_provenance(engine.monitor(), job.scene, options, statistics, wide.cost())});
  if (!buffer) return tl::unexpected(buffer.error());
  const std::uint32_t stack_bound = reinterpret_cast<const FileHeader*>(buffer->bytes().data())->stack_bound;
  if (stack_bound > kMaxStackBound)
    return tl::unexpected(Error{ErrorCode::kTooLarge, "the tree needs " + std::to_string(stack_bound) +
                                                          " stack entries, the limit is " +
                                                          std::to_string(kMaxStackBound)});
  statistics.encode_seconds = watch.lap();
  statistics.scratch_bytes_peak = engine.ledger().peak();
  return Bvh{std::move(*buffer), statistics};
}

/// The steps of a build.
Result<Bvh> run(CpuEngine& engine, const Job& job) {
  Stopwatch total, watch;
  const BuildOptions& options = job.options;
  const PrimitiveSoup soup(job.scene);
  if (auto indices = check_indices(engine, soup); !indices) return tl::unexpected(indices.error());
  if (auto shapes = check_shapes(engine, soup); !shapes) return tl::unexpected(shapes.error());
  CheckedTree checked;
  if (job.imported != nullptr) {
    auto good = check_tree(engine, *job.imported, soup);
    if (!good) return tl::unexpected(good.error());
    checked = std::move(*good);
  }
  const GroupedPrimitives grouped =
      group_primitives(engine, soup, options.pair_triangles && options.max_leaf_triangles > 1, checked.home.span());
  if (auto fits = check_fits(engine, soup, grouped, options.nodes); !fits) return tl::unexpected(fits.error());
  BuildStatistics statistics = count_input(soup, grouped, options.builder);
  statistics.pair_seconds = watch.lap();
  Result<BinaryTree> tree =
      job.imported == nullptr
          ? build_tree_or_ours(engine, statistics.builder, soup, grouped, options)
          : build_imported(engine, *job.imported, checked, soup, grouped, make_references(engine, soup, grouped));
  if (!tree) return tl::unexpected(tree.error());
  checked = CheckedTree{};
  tree = optimize(engine, std::move(*tree), *options.reinsertion_rounds);
  statistics.tree_seconds = watch.lap();
  Result<Bvh> bvh = finish(engine, job, soup, grouped, *tree, statistics);
  if (bvh) bvh->statistics.total_seconds = total.lap();
  return bvh;
}

/// run() on the threads that are wanted, with errors for exceptions.
Result<Bvh> run_guarded(const Job& job) {
  const BuildOptions options = complete(job.options);
  const Job complete_job{job.scene, options, job.imported};
  if (auto checked = check_ranges(options); !checked) return tl::unexpected(checked.error());
  if (auto checked = check_sizes(job.scene); !checked) return tl::unexpected(checked.error());
  return run_cpu("build", job.scene.meshes.size() + job.scene.customs.size(), options.threads, options.progress,
                 [&](CpuEngine& engine) { return run(engine, complete_job); });
}

}  // namespace

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

Result<Bvh> build_on(CpuEngine& engine, const SceneInput& scene, const BuildOptions& options) {
  const BuildOptions all = complete(options);
  return run(engine, {scene, all, nullptr});
}

Result<Bvh> build(std::span<const TriangleMesh> meshes, const BuildOptions& options) {
  return build(SceneInput{meshes, {}}, options);
}

Result<Bvh> build(const SceneInput& scene, const BuildOptions& options) {
  if (options.builder == Builder::kImported)
    return tl::unexpected(invalid("builder imported needs a tree: import_tree() takes one"));
  return run_guarded({scene, options, nullptr});
}

Result<Bvh> import_tree(const SceneInput& scene, const ExchangeBvh& tree, const BuildOptions& options) {
  BuildOptions imported = options;
  imported.builder = Builder::kImported;
  return run_guarded({scene, imported, &tree});
}

}  // namespace hiprt::build
