/// bvhbuild: meshes in, a BVH file out.

#include "cli.h"
#include "exchange_json.h"
#include "gpu_builder.h"
#include "mesh_inputs.h"
#include "names.h"
#include "parallel.h"
#include "progress.h"
#include "refit_command.h"
#include "report.h"
#include "trace_device.h"

#include <hiprt_build/exchange.h>
#include <hiprt_build/exec/stopwatch.h>
#include <hiprt_build/file.h>
#include <hiprt_build/statistics.h>

#include <iostream>
#include <optional>
#include <system_error>

#include <sys/resource.h>

namespace {

using namespace hiprt;
using namespace hiprt::tools;

constexpr ToolInfo kInfo{
    "bvhbuild",
    "Builds one BVH file over triangle meshes: OBJ, PLY, STL, glTF 2.0/GLB, raw .mesh and .mesh.zst.\n"
    "Every input file becomes one geometry, in the order of the command line; all nodes of a glTF file and all\n"
    "objects of an OBJ file are one geometry, triangles numbered in the file's order.\n"
    "Triangles that are not finite or have two corners in one place are dropped: they keep their number, and a\n"
    "warning says how many there are.",
    "  bvhbuild bunny.obj -o bunny.bvh\n"
    "  bvhbuild room.glb chair.ply -o scene.bvh --quality high --stats\n"
    "  bvhbuild city.ply -o city.bvh --device gpu --builder lbvh\n"
    "  bvhbuild sponza.mesh.zst -o sponza.bvh --target amd --json > sponza.json\n"
    "  bvhbuild bunny.obj -o mine.bvh --import tree.json\n"
    "  bvhbuild frame1.bvh --refit frame2.obj -o frame2.bvh\n"};

struct Options {
  std::vector<std::string> inputs, moved;
  std::string output;
  std::string builder = build::name(build::BuildOptions{}.builder), quality, nodes = "auto", target = "cpu",
              device = "cpu";
  unsigned ploc_radius = build::BuildOptions{}.ploc_radius;
  std::optional<unsigned> rounds;
  unsigned threads = 0, max_leaf = build::BuildOptions{}.max_leaf_triangles;
  double presplit_budget = build::BuildOptions{}.presplit_budget;
  std::optional<double> split_budget;
  bool no_pairs = false, stats = false, builder_given = false;
  std::string imported;  ///< Empty: none.
};

void add_options(CLI::App& app, Options& options) {
  app.add_option("INPUT", options.inputs, "Mesh files, one geometry each; with --refit a BVH file")
      ->required()
      ->type_name("FILE");
  app.add_option("-o,--output", options.output, "The BVH file to write")->required()->type_name("FILE");
  app.add_option(
         "--builder", options.builder,
         "How the tree is built: lbvh is built fastest, hq gives the fastest rays; lbvh30 and ploc are there to "
         "compare with, embree-* are Embree's")
      ->check(CLI::IsMember(words(kBuilders)))
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option("--quality", options.quality,
                 "Chooses the builder and its options. fast: lbvh, the fastest build; balanced: hploc, little slower, "
                 "with faster rays; high: hq, the fastest rays. Not together with --builder")
      ->check(CLI::IsMember(words(kQualities)))
      ->type_name("WORD")
      ->excludes("--builder");
  app.add_option("--import", options.imported,
                 "Take the tree of this JSON file (bvhinfo --export writes such files) in place of a builder's")
      ->type_name("FILE")
      ->excludes("--builder")
      ->excludes("--quality");
  app.add_option(
         "--nodes", options.nodes,
         "Layout of the nodes; auto: the one for --target. half and quantized have nodes of half the size, with "
         "boxes that are rounded outwards")
      ->check(CLI::IsMember(words(kLayouts, {"auto"})))
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option("--target", options.target, "Machine to trace on (cpu and nvidia: planes, amd: float)")
      ->check(CLI::IsMember(words(kTargetLayouts)))
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option(
         "--device", options.device,
         "What builds. gpu: all but embree-* and --import, by default hploc. auto: the GPU if there is one and it has "
         "the builder")
      ->check(CLI::IsMember(words(kDeviceChoices)))
      ->type_name("NAME")
      ->capture_default_str();
  add_threads_option(app, options.threads);
  app.add_option("--max-leaf", options.max_leaf, "Most triangles below one leaf reference, 1 to 64")
      ->check(CLI::Range(1u, 64u))
      ->type_name("N")
      ->capture_default_str();
  app.add_option(
         "--split-budget", options.split_budget,
         "References that sbvh, hq and embree-high may make of one on the way down, on average, 1 to 16 (default: "
         "3 for hq, 1.5 for the others)")
      ->check(CLI::Range(1.0, 16.0))
      ->type_name("X");
  app.add_option("--presplit-budget", options.presplit_budget,
                 "References that may be made of one by cuts before there is a tree, on average, 1 to 16. For hploc "
                 "with rounds of reinsertion")
      ->check(CLI::Range(1.0, 16.0))
      ->type_name("X")
      ->capture_default_str();
  app.add_option(
         "--reinsertion-rounds", options.rounds,
         "How often to look for better places for an eighth of the tree's nodes, 0 to 1000 (default: 32 for hq, "
         "0 for others, or what goes with --quality)")
      ->check(CLI::Range(0u, 1000u))
      ->type_name("N");
  app.add_option("--ploc-radius", options.ploc_radius, "How far ploc and hploc look for the nearest cluster, 1 to 128")
      ->check(CLI::Range(1u, 128u))
      ->type_name("N")
      ->capture_default_str();
  app.add_flag("--no-pairs", options.no_pairs, "Do not put two triangles that share an edge into one leaf")
      ->disable_flag_override();
  app.add_flag("--stats", options.stats, "Print figures of the tree, times and memory")->disable_flag_override();
}

/// --refit, which goes with none of the options of a build.
void add_refit_option(CLI::App& app, Options& options) {
  CLI::Option* refit =
      app.add_option("--refit", options.moved,
                     "Do not build: write INPUT, a BVH file, with its triangles where they are in this mesh. Once per "
                     "geometry, in their order. Says whether a rebuild is advised")
          ->allow_extra_args(false)
          ->type_name("MESH");
  for (const char* name :
       {"--builder", "--quality", "--import", "--nodes", "--target", "--device", "--max-leaf", "--split-budget",
        "--presplit-budget", "--reinsertion-rounds", "--ploc-radius", "--no-pairs", "--stats"})
    refit->excludes(app.get_option(name));
  app.callback([&app, &options] {
    options.builder_given = app.get_option("--builder")->count() != 0;
    if (!options.moved.empty() && options.inputs.size() != 1)
      throw CLI::ValidationError("--refit takes one INPUT, a BVH file; there are " +
                                 std::to_string(options.inputs.size()));
  });
}

std::uint64_t peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

struct Seconds {
  double read = 0, write = 0;
};

build::BuildOptions build_options(const Options& options, const std::string& tool, ProgressBar& bar) {
  build::BuildOptions result = options.quality.empty()
                                   ? build::BuildOptions{.builder = value_of(kBuilders, options.builder)}
                                   : build::options_for(value_of(kQualities, options.quality));
  result.nodes = options.nodes == "auto" ? value_of(kTargetLayouts, options.target) : value_of(kLayouts, options.nodes);
  result.threads = options.threads;
  result.max_leaf_triangles = options.max_leaf;
  result.presplit_budget = options.presplit_budget;
  if (options.split_budget) result.split_budget = options.split_budget;
  result.ploc_radius = options.ploc_radius;
  if (options.rounds) result.reinsertion_rounds = options.rounds;
  result.pair_triangles = !options.no_pairs;
  result.tool = tool;
  result.progress = shown_by(bar);
  return result;
}

void warn_dropped(const Cli& cli, const build::BuildStatistics& statistics) {
  const std::uint64_t not_finite = statistics.dropped_not_finite, degenerate = statistics.dropped_degenerate;
  if (not_finite + degenerate == 0) return;
  cli.warn("dropped " + std::to_string(not_finite + degenerate) + " of " + std::to_string(statistics.triangles) +
           " triangles: " + std::to_string(not_finite) + " with a corner that is not finite, " +
           std::to_string(degenerate) + " with two corners in one place");
}

double mtriangles_per_second(const build::BuildStatistics& s) {
  return s.total_seconds > 0 ? static_cast<double>(s.triangles) / s.total_seconds * 1e-6 : 0.0;
}

struct Built {
  build::Bvh bvh;
  build::Builder builder;  ///< That was asked for.
  bool on_gpu;
};

std::string report_text(const Options& options, const Built& built, const BufferView& view, Seconds seconds) {
  const build::Bvh& bvh = built.bvh;
  const build::BuildStatistics& s = bvh.statistics;
  Table table;
  table.row("file", options.output);
  table.row("bytes", bytes_text(bvh.buffer.size()));
  add_bytes_per_primitive(table, view);
  table.row("layout", word_of(kLayouts, view.layout()));
  table.row("builder", build::name(s.builder));
  table.row("device", built.on_gpu ? "gpu" : "cpu");
  table.row("geometries", std::to_string(view.geometries.size()));
  table.row("triangles", std::to_string(s.triangles));
  table.row("dropped", std::to_string(s.dropped_not_finite) + " not finite, " + std::to_string(s.dropped_degenerate) +
                           " degenerate");
  table.row("pairs", std::to_string(s.pairs));
  add_tree(table, build::measure_tree(view));
  table.row("time to read", fixed(seconds.read, 3) + " s");
  table.row("time to build", fixed(s.total_seconds, 3) + " s: pair " + fixed(s.pair_seconds, 3) + ", tree " +
                                 fixed(s.tree_seconds, 3) + ", collapse " + fixed(s.collapse_seconds, 3) + ", encode " +
                                 fixed(s.encode_seconds, 3));
  table.row("time to write", fixed(seconds.write, 3) + " s");
  table.row("build speed", fixed(mtriangles_per_second(s), 3) + " Mtriangles/s");
  table.row("builder's peak memory", bytes_text(s.scratch_bytes_peak));
  table.row("process's peak memory", bytes_text(peak_memory_bytes()));
  return table.text();
}

nlohmann::json report_json(const Options& options, const Built& built, const BufferView& view, Seconds seconds) {
  const build::Bvh& bvh = built.bvh;
  const build::BuildStatistics& s = bvh.statistics;
  return {{"file", options.output},
          {"bytes", bvh.buffer.size()},
          {"bytes_per_triangle", bytes_per_primitive(view)},
          {"layout", word_of(kLayouts, view.layout())},
          {"builder", build::name(s.builder)},
          {"device", built.on_gpu ? "gpu" : "cpu"},
          {"geometries", view.geometries.size()},
          {"triangles", s.triangles},
          {"dropped", {{"not_finite", s.dropped_not_finite}, {"degenerate", s.dropped_degenerate}}},
          {"pairs", s.pairs},
          {"tree", tree_json(build::measure_tree(view))},
          {"seconds",
           {{"read", seconds.read},
            {"pair", s.pair_seconds},
            {"tree", s.tree_seconds},
            {"collapse", s.collapse_seconds},
            {"encode", s.encode_seconds},
            {"build", s.total_seconds},
            {"write", seconds.write}}},
          {"mtriangles_per_second", mtriangles_per_second(s)},
          {"peak_bytes", {{"builder", s.scratch_bytes_peak}, {"process", peak_memory_bytes()}}}};
}

/// What build() takes the tree from; none without --import.
build::Result<std::optional<build::ExchangeBvh>> read_tree(const Options& options, ProgressBar& bar) {
  if (options.imported.empty()) return std::nullopt;
  bar.update("read", 0);
  auto tree = read_exchange(options.imported);
  if (interrupted()) return tl::unexpected(cancelled());
  if (!tree) return tl::unexpected(tree.error());
  return std::move(*tree);
}

/// What only the CPU can do.
bool needs_cpu(const build::BuildOptions& wanted, bool imported) {
  return imported || wanted.builder > build::Builder::kHq;
}

/// The GPU's tree; nothing if the CPU is to build.
build::Result<std::optional<build::Bvh>> try_gpu(std::span<const build::TriangleMesh> meshes, DeviceChoice choice,
                                                 const build::BuildOptions& wanted, bool imported) {
  if (choice == DeviceChoice::kCpu || (choice == DeviceChoice::kAuto && needs_cpu(wanted, imported)))
    return std::nullopt;
  if (needs_cpu(wanted, imported))
    return tl::unexpected(
        build::Error{build::ErrorCode::kInvalidInput, "a GPU builds neither Embree's trees nor imported ones"});
  auto bvh = build_on_gpu(meshes, wanted);
  if (bvh) return std::optional<build::Bvh>(std::move(*bvh));
  if (choice == DeviceChoice::kAuto && bvh.error().code == build::ErrorCode::kNoDevice) return std::nullopt;
  return tl::unexpected(build::Error{bvh.error().code, "GPU: " + bvh.error().message});
}

build::Result<Built> build_bvh(const std::vector<Mesh>& meshes, const std::optional<build::ExchangeBvh>& tree,
                               const Options& options, ProgressBar& bar) {
  const std::vector<build::TriangleMesh> inputs = views(meshes);
  const std::string tool = tool_version(kInfo);
  build::BuildOptions wanted = build_options(options, tool, bar);
  const DeviceChoice device = value_of(kDeviceChoices, options.device);
  const bool chosen = options.builder_given || !options.quality.empty();
  if (device == DeviceChoice::kGpu && !chosen) wanted.builder = build::Builder::kHploc;
  auto gpu = try_gpu(inputs, device, wanted, tree.has_value());
  if (!gpu) return tl::unexpected(std::move(gpu.error()));
  if (*gpu) return Built{std::move(**gpu), wanted.builder, true};
  const build::SceneInput scene{inputs, {}};
  auto bvh = tree ? build::import_tree(scene, *tree, wanted) : build::build(scene, wanted);
  bar.clear();
  if (interrupted()) return tl::unexpected(cancelled());
  if (!bvh && tree) bvh.error().message.insert(0, options.imported + ": ");
  if (!bvh) return tl::unexpected(std::move(bvh.error()));
  return Built{std::move(*bvh), tree ? build::Builder::kImported : wanted.builder, false};
}

build::Result<void> report(const Cli& cli, const Options& options, const Built& built, Seconds seconds) {
  if (!cli.json() && !options.stats) return {};
  const build::Bvh& bvh = built.bvh;
  const auto view = open_buffer(bvh.buffer.bytes());
  if (!view)
    return tl::unexpected(
        build::Error{build::ErrorCode::kBackend, "the file that was built: " + to_string(view.error())});
  if (cli.json())
    cli.print(report_json(options, built, *view, seconds));
  else
    std::cout << report_text(options, built, *view, seconds);
  return {};
}

build::Result<void> run(const Cli& cli, const Options& options) {
  const InterruptGuard guard;
  const ThreadLimit limit(options.threads);
  ProgressBar bar;
  build::Stopwatch watch;
  Seconds seconds;
  std::vector<std::string> inputs = options.inputs;
  if (!options.imported.empty()) inputs.push_back(options.imported);
  if (auto checked = check_output(options.output, inputs); !checked) return checked;
  auto meshes = read_meshes(cli, options.inputs, options.output, bar);
  if (!meshes) return tl::unexpected(meshes.error());
  auto tree = read_tree(options, bar);
  if (!tree) return tl::unexpected(tree.error());
  seconds.read = watch.lap();
  const auto built = build_bvh(*meshes, *tree, options, bar);
  if (!built) return tl::unexpected(built.error());
  const build::Bvh& bvh = built->bvh;
  meshes->clear();
  warn_dropped(cli, bvh.statistics);
  if (const build::Builder used = bvh.statistics.builder; used != built->builder)
    cli.warn(std::string(built->on_gpu ? "the GPU" : "Embree") + " gave up on " + build::name(built->builder) +
             ", the tree would be too deep; it is by " + build::name(used));
  watch.lap();
  if (auto written = build::write_file(options.output, bvh.buffer.bytes()); !written) return written;
  seconds.write = watch.lap();
  return report(cli, options, *built, seconds);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  Cli cli(kInfo);
  add_options(cli.app(), options);
  add_refit_option(cli.app(), options);
  return cli.run(argc, argv, [&] {
    if (options.moved.empty()) return run(cli, options);
    return run_refit(cli, {options.inputs.front(), options.output, options.moved, options.threads});
  });
}
