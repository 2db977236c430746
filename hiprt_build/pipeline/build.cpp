#include <hiprt_build/build.h>
#include <hiprt_build/embree/embree.h>
#include <hiprt_build/encode/encode.h>
#include <hiprt_build/exchange/imported.h>
#include <hiprt_build/exec/run_cpu.h>
#include <hiprt_build/exec/stopwatch.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/input/builder_defaults.h>
#include <hiprt_build/input/check_input.h>
#include <hiprt_build/input/check_options.h>
#include <hiprt_build/input/provenance.h>
#include <hiprt_build/input/references.h>
#include <hiprt_build/lbvh_ploc/bottom_up.h>
#include <hiprt_build/pipeline/build_on.h>
#include <hiprt_build/presplit/presplit.h>
#include <hiprt_build/reinsert/reinsert.h>
#include <hiprt_build/reinsert/reinsert_steps.h>
#include <hiprt_build/sah_sbvh/sah.h>
#include <hiprt_build/sah_sbvh/sbvh.h>
#include <hiprt_device/format/buffer.h>

namespace hiprt::build {
namespace {

/// The input of a build. With an imported tree there is no builder.
struct Job {
  const SceneInput& scene;
  const BuildOptions& options;
  const ExchangeBvh* imported;
};

ScratchArray<Reference> make_references(CpuEngine& engine, const GeometryTable& geometries,
                                        const PairedPrimitives& paired) {
  auto references = engine.allocate<Reference>(paired.count);
  engine.for_each(paired.count, MakeReferenceStep{geometries, paired.leaves.span(), references.span()});
  return references;
}

Result<DepthFirstTree> build_tree(CpuEngine& engine, Builder builder, const GeometryTable& geometries,
                                  const PairedPrimitives& paired, const BuildOptions& options) {
  auto references = make_references(engine, geometries, paired);
  const double split_budget = paired.custom_count == 0 ? *options.split_budget : 1.0;
  if (paired.custom_count == 0)
    references = presplit(engine, geometries, std::move(references), options.presplit_budget);
  switch (builder) {
    case Builder::kHq:
    case Builder::kSbvh:
      return build_sbvh(engine, geometries, std::move(references), split_budget, defaults_of(builder).splits);
    case Builder::kSah:
      return build_sah(engine, std::move(references));
    case Builder::kLbvh:
    case Builder::kLbvh30:
    case Builder::kPloc:
    case Builder::kHploc:
      return build_bottom_up(engine, builder, std::move(references), options.ploc_radius);
    default:
      return build_embree(engine, builder, geometries, std::move(references), split_budget);
  }
}

/// Embree's builders fail on scenes whose tree would be too deep (triangle sizes over hundreds of powers of two). Then
/// Builder::kSah is used.
Result<DepthFirstTree> build_tree_or_ours(CpuEngine& engine, Builder& builder, const GeometryTable& geometries,
                                          const PairedPrimitives& paired, const BuildOptions& options) {
  Result<DepthFirstTree> tree = build_tree(engine, builder, geometries, paired, options);
  if (tree || tree.error().code != ErrorCode::kBackend) return tree;
  builder = Builder::kSah;
  return build_tree(engine, builder, geometries, paired, options);
}

/// What is known once the primitives are paired.
BuildStatistics count_input(const BuildInput& input, const PairedPrimitives& paired, Builder builder) {
  BuildStatistics statistics;
  for (const TriangleMesh& mesh : input.meshes) statistics.triangles += mesh.triangles.size();
  statistics.customs = input.primitive_count() - statistics.triangles;
  statistics.dropped_not_finite = paired.dropped_not_finite;
  statistics.dropped_degenerate = paired.dropped_degenerate;
  statistics.pairs = paired.pairs;
  statistics.custom_pairs = paired.custom_pairs;
  // The builder does not know the shape of a custom primitive in a part of its box: it is not split.
  const bool may_split = paired.custom_count == 0;
  statistics.builder = builder == Builder::kEmbreeHigh && !may_split ? Builder::kEmbreeMedium : builder;
  return statistics;
}

/// Whether a file can hold the primitives.
Result<void> check_fits(CpuEngine& engine, const BuildInput& input, const PairedPrimitives& paired, NodeLayout layout) {
  // References and tree nodes are numbered with 32 bits: refused before there are any.
  if (auto leaves = check_addresses(layout, 1, paired.count); !leaves) return leaves;
  return layout == NodeLayout::kQuantized ? check_quantizable(engine, input, paired) : Result<void>{};
}

/// Collapses and encodes a tree.
Result<Bvh> finish(CpuEngine& engine, const Job& job, const BuildInput& input, const PairedPrimitives& paired,
                   const DepthFirstTree& tree, BuildStatistics statistics) {
  Stopwatch watch;
  const BuildOptions& options = job.options;
  const WideTree wide(engine, tree, options.costs, options.max_leaf_triangles);
  statistics.leaves = tree.references.size();
  statistics.nodes = tree.empty() || wide.is_run(0) ? 0 : wide.node_count(0);
  statistics.collapse_seconds = watch.lap();
  Result<Buffer> buffer =
      encode(engine, {input, paired, tree, wide, options.nodes, options.widen_boxes,
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
Result<Bvh> run(CpuEngine& engine, const Job& wanted) {
  Stopwatch total, watch;
  // Of job: the budget follows from the paired triangles.
  BuildOptions options = with_defaults(wanted.options);
  const Job job{wanted.scene, options, wanted.imported};
  const BuildInput input(job.scene);
  const GeometryTable geometries = input.table();
  if (auto indices = check_indices(engine, input); !indices) return tl::unexpected(indices.error());
  if (auto pairs = check_pairs(engine, input); !pairs) return tl::unexpected(pairs.error());
  if (auto shapes = check_shapes(engine, input); !shapes) return tl::unexpected(shapes.error());
  CheckedTree checked;
  if (job.imported != nullptr) {
    auto good = check_tree(engine, *job.imported, input);
    if (!good) return tl::unexpected(good.error());
    checked = std::move(*good);
  }
  const PairedPrimitives paired =
      pair_primitives(engine, input, options.pair_triangles && options.max_leaf_triangles > 1, checked.home.span());
  if (auto fits = check_fits(engine, input, paired, options.nodes); !fits) return tl::unexpected(fits.error());
  BuildStatistics statistics = count_input(input, paired, options.builder);
  statistics.pair_seconds = watch.lap();
  if (splits_as_needed(wanted.options) && paired.custom_count == 0)
    options.split_budget =
        split_budget_for(measure_demand(engine, geometries, paired.leaves.span().first(paired.count)),
                         *options.split_budget, std::numeric_limits<double>::infinity());
  Result<DepthFirstTree> tree =
      job.imported == nullptr
          ? build_tree_or_ours(engine, statistics.builder, geometries, paired, options)
          : build_imported(engine, *job.imported, checked, geometries, make_references(engine, geometries, paired));
  if (!tree) return tl::unexpected(tree.error());
  checked = CheckedTree{};
  unsigned rounds = *options.reinsertion_rounds;
  if (!wanted.options.reinsertion_rounds) rounds = usual_rounds(rounds, paired.count, tree->references.size());
  tree = reinsert(engine, std::move(*tree), rounds);
  statistics.tree_seconds = watch.lap();
  Result<Bvh> bvh = finish(engine, job, input, paired, *tree, statistics);
  if (bvh) bvh->statistics.total_seconds = total.lap();
  return bvh;
}

/// Checks the input and calls run() on the wanted threads.
Result<Bvh> run_checked(const Job& job) {
  if (auto checked = check_ranges(with_defaults(job.options)); !checked) return tl::unexpected(checked.error());
  if (auto checked = check_sizes(job.scene); !checked) return tl::unexpected(checked.error());
  return run_cpu("build", job.options.threads, job.options.progress,
                 [&](CpuEngine& engine) { return run(engine, job); });
}

/// Exceptions become errors.
Result<Bvh> run_guarded(const Job& job) {
  return or_out_of_memory("for the build", [&] { return run_checked(job); });
}

}  // namespace

SceneView Bvh::scene() const { return host.scene(*open_buffer(buffer.bytes())); }

BuildOptions options_for(Quality quality) {
  switch (quality) {
    case Quality::kFast:
      return {.builder = Builder::kLbvh};
    case Quality::kBalanced:
      return {.builder = Builder::kSbvh};
    case Quality::kHigh:
      return {.builder = Builder::kHq};
  }
  return {.builder = static_cast<Builder>(-1)};
}

Result<Bvh> build_on(CpuEngine& engine, const SceneInput& scene, const BuildOptions& options) {
  return run(engine, {scene, options, nullptr});
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
