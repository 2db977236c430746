/// bvhquery: asks the points, spheres and boxes of a file of a BVH file, and draws distance fields.

#include <tools/base/interrupt.h>
#include <tools/base/memory_limit.h>
#include <tools/base/output_file.h>
#include <tools/cli/bvh_file.h>
#include <tools/cli/cli.h>
#include <tools/cli/progress.h>
#include <tools/cli/trace/trace_records.h>
#include <tools/query/query_command.h>
#include <tools/query/write_results.h>
#include <tools/render/image/image_write.h>
#include <tools/render/tracers/tracer.h>

#include <hiprt_build/format/view.h>
#include <hiprt_build/winding.h>
#include <hiprt_device/scene_view.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <array>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <optional>
#include <sstream>
#include <utility>

namespace {

using namespace hiprt;
using namespace hiprt::tools;

constexpr ToolInfo kInfo{
    "bvhquery",
    "Finds what is near points, and the triangles that touch spheres and boxes. The BVH file is validated first.\n"
    "It runs on the CPU. Files of spheres and curves: closest, nearest and within; to the surface, also from inside.\n"
    "\n"
    "Queries:\n"
    "  closest      the closest point of any triangle, sphere or curve\n"
    "  signed       the same; the distance is negative inside closed meshes\n"
    "  nearest      the K nearest triangles, spheres and curves, the nearest first\n"
    "  within       all within the distance, the nearest first\n"
    "  inside       whether a point is inside closed meshes\n"
    "  overlaps     all triangles that touch a sphere or box, in the order of their numbers\n"
    "  any-overlap  one triangle that touches a sphere (the closest) or box\n"
    "\n"
    "Files, all little-endian. Files may also be arrays of numpy, .npy: see below.\n"
    "  points   u32 count, u32 3, count x 3 float32 {x, y, z}\n"
    "  spheres  u32 count, u32 4, count x 4 float32 {x, y, z, radius}\n"
    "  boxes    u32 count, u32 6, count x 6 float32 {min, max}\n"
    "  results  u32 count, u32 K (1 if not nearest), count x K records\n"
    "  lists    u32 count, u32 0, (count + 1) x u64 number of the first record, records (of within and overlaps)\n"
    "  paths    u32 count of records, u32 levels, count x levels x {u32 instance, u32 id}\n"
    "A record of closest, signed, nearest and within is {float32 distance, float32 x, y, z, float32 u, v, u32\n"
    "primitive, u32 feature}. The distance inf and the primitive 0xffffffff say that nothing was found. u and v are\n"
    "the weights of the triangle's corners 1 and 2. Features: 0 face, 1 to 3 edges, 4 to 6 vertices. On spheres and\n"
    "curves u and v are those of hits, and the feature is 0.\n"
    "A record of overlaps and any-overlap is the u32 primitive. A record of inside is a u32: 1 inside, 0 outside.\n"
    "Primitives and paths are numbered as by bvhtrace. Queries that are not finite find nothing.\n"
    "\n"
    "Arrays of numpy: points, spheres and boxes are float32 or float64 of the shape (n, 3), (n, 4) or (n, 6). An "
    "output\n"
    "that ends in .npy is an array of records with the fields distance, point, u, v, primitive and feature, or of\n"
    "numbers. Lists are one array, with the number of the query as first field. Paths have the fields instance and "
    "id.\n"
    "float64 is rounded to float32, boxes outwards.\n"
    "\n"
    "--slice draws the distances on a plane: orange outside, blue inside, the surface in white, and lines of equal\n"
    "distance. EXR files have the distance (Z), the closest point (P) and the primitive (id.primitive) as layers.",
    "  bvhquery scene.bvh --points probes.points -o out.results                            # the closest points\n"
    "  bvhquery scene.bvh --points probes.points -o out.results --query signed             # with a sign\n"
    "  bvhquery scene.bvh --points probes.points -o out.results --query nearest -k 4       # the 4 nearest triangles\n"
    "  bvhquery scene.bvh --points probes.points -o out.lists --query within --max-distance 0.1\n"
    "  bvhquery scene.bvh --boxes voxels.boxes -o out.lists                                # triangles of each voxel\n"
    "  bvhquery forest.bvh --spheres balls.spheres -o out.lists --paths out.paths          # in which instances\n"
    "  bvhquery scene.bvh --points probes.npy -o out.npy                                   # arrays of numpy\n"
    "  bvhquery scan.bvh --points probes.points -o out.results --query inside --sign winding\n"
    "  bvhquery scene.bvh --slice z=0.5 -o field.png                                       # a distance field\n"};

struct Outcome {
  double seconds = 0;
  std::size_t queries = 0;
  unsigned threads = 1;
};

build::Result<QueryResults> ask(const QueryWork& work, const ThreadLimit& limit, Outcome& outcome) {
  ProgressBar bar;
  const auto start = std::chrono::steady_clock::now();
  auto results = run_queries(work, limit, [&](double done) { bar.update("query", done); });
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  outcome.queries = work.batch.size();
  outcome.threads = limit.threads();
  return results;
}

nlohmann::json report(const QueryCommand& command, QueryKind kind, const Outcome& outcome) {
  return {{"file", command.path},
          {"query", word_of(kQueryKinds, kind)},
          {"queries", outcome.queries},
          {"device", "cpu"},
          {"threads", outcome.threads},
          {"instruction_set", trace_isa()},
          {"seconds", outcome.seconds},
          {"mqueries_per_second",
           outcome.seconds > 0 ? static_cast<double>(outcome.queries) / outcome.seconds * 1e-6 : 0.0}};
}

std::string speed_text(const nlohmann::json& told) {
  std::ostringstream text;
  text << told["mqueries_per_second"].get<double>() << " Mqueries/s (cpu " << trace_isa() << ")\n";
  return text.str();
}

build::Result<void> run_batch(const Cli& cli, const QueryCommand& command, const SceneView& scene,
                              const WindingTree* winding, const ThreadLimit& limit) {
  std::optional<MemoryLimit> reading(std::in_place, command.max_memory);
  const auto batch = read_queries(command.input(), command.shape());
  if (!batch) return tl::unexpected(batch.error());
  reading.reset();
  Outcome outcome;
  const QueryWork work{scene, *batch, command.kind(), command.nearest, command.max_distance, command.time, winding};
  const auto results = ask(work, limit, outcome);
  if (!results) return tl::unexpected(results.error());
  if (auto written = write_all(command, scene, *results, batch->size()); !written) return written;
  nlohmann::json told = report(command, work.kind, outcome);
  if (cli.json()) {
    told.update({{"found", results->found}, {"records", results->records()}, {"levels", scene.levels}});
    cli.print(told);
  } else {
    std::cout << outcome.queries << " " << plural(batch->shape) << ", " << results->found
              << (work.kind == QueryKind::kInside ? " inside, " : " with results, ") << results->records()
              << " records, " << word_of(kQueryKinds, work.kind) << ": " << speed_text(told);
  }
  return {};
}

ImageAttributes attributes_of(const QueryCommand& command, const SliceGrid& grid, QueryKind kind) {
  const Vec3 first = grid.at(0, 0);
  const auto text = [](double value) { return nlohmann::json(value).dump(); };
  return {
      {"software", tool_version(kInfo)},
      {"scene", command.path},
      {"query", word_of(kQueryKinds, kind)},
      {"first_pixel", text(first.x) + "," + text(first.y) + "," + text(first.z)},
      {"pixel_size", text(grid.step())},
      {"axes", std::string{"xyz"[grid.right()], ',', "xyz"[grid.up()]}},
      {"comments",
       "Z is the distance, inf where nothing was found; P is the closest point, id.primitive its triangle, numbered "
       "over all geometries. first_pixel is the centre of the top left pixel."}};
}

build::Result<void> run_slice(const Cli& cli, const QueryCommand& command, const SceneView& scene,
                              const WindingTree* winding, const ThreadLimit& limit) {
  const SliceGrid grid(scene.bounds, *parse_plane(command.slice), *parse_size(command.size));
  const QueryBatch batch = grid.points();
  Outcome outcome;
  const QueryWork work{scene, batch, command.kind(), 1, command.max_distance, command.time, winding};
  const auto results = ask(work, limit, outcome);
  if (!results) return tl::unexpected(results.error());
  const SliceScale scale = scale_of(results->points);
  const Image image = draw_slice(grid, results->points, scale);
  ProgressBar bar;
  const auto progress = [&](double done) {
    bar.update("encode", done);
    return !interrupted();
  };
  const auto bytes = is_exr(command.output)
                         ? write_exr(command.output, image, attributes_of(command, grid, work.kind), progress)
                         : write_png(command.output, image, progress);
  if (!bytes) return tl::unexpected(bytes.error());
  bar.clear();
  nlohmann::json told = report(command, work.kind, outcome);
  if (cli.json()) {
    told.update({{"width", image.width},
                 {"height", image.height},
                 {"position", grid.position()},
                 {"pixel_size", grid.step()},
                 {"distances", {scale.nearest, scale.farthest}},
                 {"contours", scale.contours},
                 {"bytes", *bytes}});
    cli.print(told);
  } else {
    std::cout << image.width << " x " << image.height << " pixels of " << grid.step() << ", distances " << scale.nearest
              << " to " << scale.farthest << ", a line every " << scale.contours << ": " << speed_text(told);
  }
  return {};
}

/// Checks that the outputs can be written and are neither inputs nor the same file.
build::Result<void> check_outputs(const QueryCommand& command) {
  const std::array inputs{command.path, command.input()};
  if (auto checked = check_output(command.output, inputs); !checked || command.paths.empty()) return checked;
  std::error_code ignored;
  if (std::filesystem::weakly_canonical(command.paths, ignored) ==
      std::filesystem::weakly_canonical(command.output, ignored))
    return tl::unexpected(
        build::Error{build::ErrorCode::kInvalidInput, command.paths + ": --output and --paths are one file"});
  return check_output(command.paths, inputs);
}

build::Result<void> run(const Cli& cli, const QueryCommand& command) {
  const InterruptGuard guard;
  const ThreadLimit limit(command.threads);
  if (auto checked = check_outputs(command); !checked) return checked;
  const auto file = load_bvh(command.path, command.max_memory, command.threads);
  if (!file) return tl::unexpected(file.error());
  if (auto checked = check_primitive_counts(command.path, file->view); !checked) return checked;
  if (needs_triangles(command.kind()))
    if (auto checked = check_triangles_only(command.path, file->view); !checked) return checked;
  if (auto checked = check_traceable(command.path, file->view); !checked) return checked;
  const SceneView scene = make_scene_view(file->view);
  build::WindingArrays arrays;
  if (command.uses_winding()) {
    auto made = build::winding_arrays(file->view, 0xffffffffu, command.threads);
    if (!made) return tl::unexpected(build::Error{made.error().code, command.path + ": " + made.error().message});
    arrays = std::move(*made);
  }
  const WindingTree tree = arrays.tree();
  const WindingTree* const winding = command.uses_winding() ? &tree : nullptr;
  return command.is_slice() ? run_slice(cli, command, scene, winding, limit)
                            : run_batch(cli, command, scene, winding, limit);
}

}  // namespace

int main(int argc, char** argv) {
  QueryCommand command;
  Cli cli(kInfo);
  add_query_options(cli.app(), command);
  cli.app().callback([&] { check_query_command(cli.app(), command); });
  return cli.run(argc, argv, [&] { return run(cli, command); });
}
