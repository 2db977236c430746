/// bvhbuild: builds a BVH file over meshes, shapes or a scene of instances.

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/base/memory_limit.h>
#include <tools/base/output_file.h>
#include <tools/base/parallel.h>
#include <tools/build/build_meshes.h>
#include <tools/build/build_progress.h>
#include <tools/build/build_scene.h>
#include <tools/build/bvh_cache.h>
#include <tools/build/shape_geometries.h>
#include <tools/cli/build/build_command.h>
#include <tools/cli/build/build_report.h>
#include <tools/cli/build/build_warnings.h>
#include <tools/cli/build/mesh_inputs.h>
#include <tools/cli/build/parts_command.h>
#include <tools/cli/build/refit_command.h>
#include <tools/cli/build/scene_input.h>
#include <tools/cli/build/shape_inputs.h>
#include <tools/cli/cli.h>
#include <tools/cli/progress.h>
#include <tools/cli/ranks/join_ranks.h>
#include <tools/distributed/launch.h>
#include <tools/farm/farm_command.h>
#include <tools/scene_io/exchange_json.h>
#include <tools/scene_io/scene/scene_bake.h>
#include <tools/scene_io/scene/scene_flatten.h>
#include <tools/scene_io/scene/scene_merge.h>
#include <tools/scene_io/scene/scene_motion.h>

#include <hiprt_build/exchange.h>
#include <hiprt_build/exec/stopwatch.h>
#include <hiprt_build/file.h>

#include <nlohmann/json.hpp>

#include <iostream>
#include <memory>
#include <optional>
#include <utility>

namespace {

using namespace hiprt;
using namespace hiprt::tools;

constexpr ToolInfo kInfo{
    "bvhbuild",
    "Builds one BVH file over triangle meshes, shapes or a scene of instances.\n"
    "\n"
    "Meshes: OBJ, PLY, STL, glTF 2.0 (.gltf, .glb), raw .mesh and .mesh.zst. Shapes: strands of .hair, spheres of\n"
    ".xyzr. Every file becomes one geometry, in the order of the command line: first the meshes, then the shapes.\n"
    "All nodes of a glTF file and all objects of an OBJ file make one geometry.\n"
    "Triangles keep the order of the file. The builder drops triangles that are not finite or have two equal\n"
    "corners. They keep their numbers, and a warning tells how many there are.\n"
    "\n"
    "A .json or .scene file describes a scene of instances: objects of meshes and shapes, and groups of instances on\n"
    "any number of levels. Formats: tools/scene_io/scene/scene.schema.json and tools/scene_io/scene/scene_binary.h.",
    "  bvhbuild bunny.obj -o bunny.bvh                                  # one mesh\n"
    "  bvhbuild room.glb chair.ply -o scene.bvh --quality high --stats  # several meshes, the fastest rays\n"
    "  bvhbuild city.ply -o city.bvh --device gpu                       # a build on the GPU\n"
    "  bvhbuild sponza.mesh.zst -o sponza.bvh --target amd              # for another machine\n"
    "  bvhbuild city.glb -o city.bvh --instances                        # glTF nodes as instances\n"
    "  bvhbuild forest.json -o forest.bvh --levels 1 --quality high     # a described scene of instances\n"
    "  bvhbuild wig.hair head.obj -o wig.bvh                            # curves and a mesh\n"
    "  bvhbuild frame1.bvh --refit frame2.obj -o frame2.bvh             # the next frame of an animation\n"
    "  bvhbuild bunny.obj -o mine.bvh --import tree.json                # a tree of your own\n"
    "  bvhbuild forest.json -o forest.bvh --cache built                 # builds only objects that are new\n"
    "  bvhbuild city.json --parts 8 -o parts/city.json                  # for bvhrender on 8 machines\n"
    "  mpirun -n 8 bvhbuild --manifest assets.json --cache built        # many assets on 8 ranks\n"
    "  bvhbuild --cache built --prune 20G                               # keeps the 20 GiB that were used last\n"};

/// Warns of levels that could not be merged.
void warn_kept(const Cli& cli, const SceneDescription& scene) {
  const build::MergedLevels& merged = *scene.merged;
  if (merged.kept_moving + merged.kept_masks == 0) return;
  cli.warn(scene.path + ": " + std::to_string(merged.levels) +
           " levels are left; instances of groups that stay: " + std::to_string(merged.kept_moving) + " for motion, " +
           std::to_string(merged.kept_masks) + " for masks that no one mask stands for");
}

/// @return the cache of --cache, or nothing.
build::Result<std::optional<BvhCache>> open_cache(const BuildCommand& command) {
  if (command.cache.empty()) return std::nullopt;
  auto cache = BvhCache::open(command.cache);
  if (!cache) return tl::unexpected(cache.error());
  return std::move(*cache);
}

/// @return the tree of --import, or nothing.
build::Result<std::optional<build::ExchangeBvh>> read_tree(const BuildCommand& command, ProgressBar& bar) {
  if (command.imported.empty()) return std::nullopt;
  bar.update("read", 0);
  auto tree = read_exchange(command.imported);
  if (interrupted()) return cancelled();
  if (!tree) return tl::unexpected(tree.error());
  return std::move(*tree);
}

/// Writes the file and calls report(view, seconds) if the command line asks for one.
template <class Report>
build::Result<void> write_and_report(const Cli& cli, const BuildCommand& command, std::span<const std::byte> file,
                                     BuildSeconds seconds, const Report& report) {
  build::Stopwatch watch;
  if (auto written = build::write_file(command.output, file); !written) return written;
  seconds.write = watch.lap();
  if (!cli.json() && !command.stats) return {};
  const auto view = open_buffer(file);
  if (!view)
    return tl::unexpected(
        build::Error{build::ErrorCode::kBackend, "the file that was built: " + to_string(view.error())});
  report(*view, seconds);
  return {};
}

/// Builds one BVH. Calls release() after the last use of the scene.
template <class Release>
build::Result<void> build_flat(const Cli& cli, const BuildCommand& command, const build::SceneInput& scene,
                               const std::optional<build::ExchangeBvh>& tree, double read_seconds, ProgressBar& bar,
                               const Release& release) {
  const std::string tool = tool_version(kInfo);
  BuildRequest request = make_request(command, tool);
  request.options.progress = build_progress(bar.sink());
  const auto cache = open_cache(command);
  if (!cache) return tl::unexpected(cache.error());
  if (*cache) request.cache = &**cache;
  CacheCounts counts;
  const auto built = tree ? build_meshes(scene, request, tree) : build_or_reuse(scene, request, counts);
  bar.clear();
  if (!built) return tl::unexpected(built.error());
  release();
  warn_cache(cli, counts);
  warn_dropped(cli, built->bvh.statistics);
  if (const build::Builder used = built->bvh.statistics.builder; used != built->builder)
    cli.warn(std::string(built->on_gpu ? "the GPU" : "Embree") + " gave up on " + build::name(built->builder) +
             ", the tree would be too deep; it is by " + build::name(used));
  return write_and_report(cli, command, built->bvh.buffer.bytes(), {.read = read_seconds},
                          [&](const BufferView& view, BuildSeconds seconds) {
                            if (cli.json())
                              cli.print(report_json(command.output, *built, view, seconds));
                            else
                              std::cout << report_text(command.output, *built, view, seconds);
                          });
}

build::Result<void> run_meshes(const Cli& cli, const BuildCommand& command, ProgressBar& bar) {
  build::Stopwatch watch;
  std::optional<MemoryLimit> reading(std::in_place, command.max_memory);
  std::vector<std::string> mesh_files, shape_files;
  for (const std::string& input : command.inputs) (is_shape_file(input) ? shape_files : mesh_files).push_back(input);
  auto meshes = read_meshes(cli, mesh_files, command.output, bar);
  if (!meshes) return tl::unexpected(meshes.error());
  auto sets = read_shapes(cli, shape_files, command.output, bar);
  if (!sets) return tl::unexpected(sets.error());
  const auto tree = read_tree(command, bar);
  if (!tree) return tl::unexpected(tree.error());
  reading.reset();
  auto shapes = ShapeGeometries::make(pointers(*sets), command.threads);
  if (!shapes) return tl::unexpected(shapes.error());
  const std::vector<build::TriangleMesh> mesh_views = views(*meshes);
  const auto release = [&] {
    meshes->clear();
    shapes = ShapeGeometries{};
    sets->clear();
  };
  return build_flat(cli, command, {mesh_views, shapes->customs()}, *tree, watch.lap(), bar, release);
}

/// Prepares a scene of instances for the builder. Warns of each part that will differ from the files.
build::Result<void> prepare_scene(const Cli& cli, const BuildCommand& command, SceneDescription& scene) {
  if (const RepairedMotions repaired = repair_motions(scene); repaired.flat_keys != 0)
    cli.warn(scene.path + ": keys of motions that are flat: " + std::to_string(repaired.flat_keys) + ", the first of " +
             repaired.first + "; they get a thickness of 1/65536 of their size");
  const auto baked = bake_singular(scene);
  if (interrupted()) return cancelled();
  if (!baked) return tl::unexpected(baked.error());
  if (baked->instances != 0)
    cli.warn(scene.path + ": instances without inverse: " + std::to_string(baked->instances) + ", the first is " +
             baked->first + "; " + std::to_string(baked->triangles) + " triangles of them become objects of their own");
  if (command.levels != 0) {
    if (auto merged = merge_scene(scene, command.levels); !merged) return merged;
    warn_kept(cli, scene);
  }
  return {};
}

build::Result<void> run_scene(const Cli& cli, const BuildCommand& command, ProgressBar& bar) {
  build::Stopwatch watch;
  std::optional<MemoryLimit> reading(std::in_place, command.max_memory);
  auto scene = read_scene(cli, command, bar);
  if (!scene) return tl::unexpected(scene.error());
  reading.reset();
  if (command.flatten) {
    auto geometries = flatten_scene(*scene);
    if (interrupted()) return cancelled();
    if (!geometries) return tl::unexpected(geometries.error());
    const std::vector<build::TriangleMesh> mesh_views = views(*geometries);
    return build_flat(cli, command, {mesh_views, {}}, std::nullopt, watch.lap(), bar, [&] { geometries->clear(); });
  }
  if (auto prepared = prepare_scene(cli, command, *scene); !prepared) return prepared;
  const double read_seconds = watch.lap();
  const std::string tool = tool_version(kInfo);
  BuildRequest request = make_request(command, tool);
  const auto cache = open_cache(command);
  if (!cache) return tl::unexpected(cache.error());
  if (*cache) request.cache = &**cache;
  if (command.parts != 0) return run_parts(cli, command, *scene, request, read_seconds, bar);
  const auto built = build_scene(*scene, request, bar.sink());
  bar.clear();
  if (!built) return tl::unexpected(built.error());
  warn_scene(cli, *scene, *built);
  return write_and_report(cli, command, built->file.bytes(), {.read = read_seconds},
                          [&](const BufferView& view, BuildSeconds seconds) {
                            if (cli.json())
                              cli.print(report_json(command.output, *scene, *built, view, seconds));
                            else
                              std::cout << report_text(command.output, *scene, *built, view, seconds);
                          });
}

build::Result<void> run(const Cli& cli, const BuildCommand& command) {
  const InterruptGuard guard;
  const ThreadLimit limit(command.threads);
  ProgressBar bar;
  std::vector<std::string> inputs = command.inputs;
  if (!command.imported.empty()) inputs.push_back(command.imported);
  if (auto checked = check_output(command.output, inputs); !checked) return checked;
  return command.is_scene() ? run_scene(cli, command, bar) : run_meshes(cli, command, bar);
}

}  // namespace

int main(int argc, char** argv) {
  BuildCommand command;
  Cli cli(kInfo);
  add_build_options(cli.app(), command);
  std::unique_ptr<Ranks> ranks;
  const int status = cli.run(argc, argv, [&]() -> build::Result<void> {
    if (command.inputs.empty()) {
      if (auto joined = join_ranks(cli, command.lossy_ranks, ranks); !joined) return joined;
      return run_farm_command(cli, command, tool_version(kInfo), *ranks);
    }
    if (const auto launch = launch_of_environment(); launch && launch->size > 1 && is_first_of_launch())
      return invalid_input("it was started as " + std::to_string(launch->size) +
                           " ranks, which share only the assets of --manifest: start it alone");
    if (!is_first_of_launch()) return {};
    if (command.moved.empty()) return run(cli, command);
    return run_refit(cli, {command.inputs.front(), command.output, command.moved, command.threads, command.max_memory});
  });
  return leave_run(ranks.get(), status);
}
