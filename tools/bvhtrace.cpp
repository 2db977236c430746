/// bvhtrace: traces the rays of a file through a BVH file.

#include <tools/base/interrupt.h>
#include <tools/base/memory_limit.h>
#include <tools/base/output_file.h>
#include <tools/base/parallel.h>
#include <tools/cli/bvh_file.h>
#include <tools/cli/cli.h>
#include <tools/cli/explain.h>
#include <tools/cli/progress.h>
#include <tools/cli/trace_device.h>
#include <tools/cli/trace_names.h>
#include <tools/cli/trace_records.h>
#include <tools/scene_io/rays_file.h>

#include <hiprt_build/format/view.h>
#include <hiprt_build/host/host_part.h>
#include <hiprt_device/scene_view.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <functional>
#include <iostream>
#include <optional>
#include <span>
#include <utility>

namespace {

using namespace hiprt;
using namespace hiprt::tools;

constexpr ToolInfo kInfo{
    "bvhtrace",
    "Traces the rays of a file and writes the hits. The BVH file is validated first.\n"
    "CPU and GPU give identical hits (with --triangle-test fast or --box-test plain the last bits may differ).\n"
    "The reported speed of a GPU is that of its kernels, without copies.\n"
    "\n"
    "Files, all little-endian:\n"
    "  rays   u32 count, u32 any-hit flag, count x 8 float32 {origin, tmin, direction, tmax}\n"
    "  hits   count x {float32 t (inf: a miss), u32 primitive (0xffffffff: a miss)}\n"
    "  paths  u32 count, u32 levels, count x levels x {u32 instance, u32 id}\n"
    "Primitives are numbered over all geometries in order. In scenes of instances they are numbered in the file of\n"
    "their object. A path lists the instances from the outermost one to the object: the index in the file that has\n"
    "the instance, and the id that the program gave it. Unused entries are 0xffffffff.\n"
    "Rays that are not finite, have no direction or have an empty range miss. With --query any the result is the\n"
    "first hit that was found.\n"
    "\n"
    "--explain N prints the traversal of ray N (counted from 0) instead: the nodes and leaves that it visits, the\n"
    "children whose boxes it meets, and the primitives and instances with what happens to them.",
    "  bvhtrace scene.bvh --rays primary.rays --hits out.hits                           # the closest hits\n"
    "  bvhtrace scene.bvh --rays shadow.rays --hits out.hits --query any                # any hit\n"
    "  bvhtrace scene.bvh --rays primary.rays --hits out.hits --device gpu --repeat 9   # measure a GPU\n"
    "  bvhtrace scene.bvh --rays primary.rays --hits out.hits --threads 1 --repeat 9    # measure one CPU thread\n"
    "  bvhtrace forest.bvh --rays primary.rays --hits out.hits --paths out.paths        # which instances were hit\n"
    "  bvhtrace wheel.bvh --rays primary.rays --hits out.hits --time 0.5                # a scene that moves\n"
    "  bvhtrace scene.bvh --rays primary.rays --explain 1234                            # why a ray misses\n"};

/// Rays per task: enough to hide the cost of scheduling, few enough to balance the load.
constexpr std::size_t kBatch = 4096;

struct Options {
  std::string path, rays, hits, paths;
  std::string query = "auto", triangle_test = "watertight", box_test = "conservative", device = "auto";
  unsigned threads = 0, repeat = 1;
  std::uint64_t max_memory = 0;  ///< Bytes that readers may take; 0: half of the machine's.
  float time = 0.0f;
  std::optional<std::uint64_t> explained;
};

void add_file_options(CLI::App& app, Options& options) {
  app.add_option("FILE", options.path, "BVH file to trace")->required()->type_name("")->group(kInputGroup);
  app.add_option("--rays", options.rays, "Rays to trace")->required()->type_name("FILE")->group(kInputGroup);
  app.add_option("--hits", options.hits, "File of hits to write")->type_name("FILE")->group(kOutputGroup);
  app.add_option("--paths", options.paths, "File of paths to write: the instances that lead to each hit")
      ->type_name("FILE")
      ->group(kOutputGroup);
  app.add_option("--explain", options.explained, "Print the traversal of this ray. Write nothing")
      ->excludes("--hits")
      ->excludes("--paths")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N")
      ->group(kOutputGroup);
}

void add_tracing_options(CLI::App& app, Options& options) {
  constexpr const char* kGroup = "Tracing";
  app.add_option("--query", options.query, "Kind of query. auto: as the any-hit flag of the ray file says")
      ->check(CLI::IsMember(words(kQueries, {"auto"})))
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--triangle-test", options.triangle_test,
                 "Triangle test. fast may miss at edges and corners, reference decides exactly")
      ->check(CLI::IsMember(words(kTriangleTests)))
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--box-test", options.box_test, "Box test. plain may miss boxes that a ray grazes")
      ->check(CLI::IsMember(words(kBoxTests)))
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--time", options.time, "Time of all rays, for scenes that move")
      ->type_name("T")
      ->capture_default_str()
      ->group(kGroup);
  add_device_option(app, options.device);
  add_threads_option(app, options.threads);
  add_memory_option(app, options.max_memory);
  app.add_option("--repeat", options.repeat, "Trace N times and report the median speed")
      ->check(CLI::Range(1u, 1000000u))
      ->type_name("N")
      ->capture_default_str()
      ->group(kMachineGroup);
  app.get_option("--explain")->excludes("--repeat");
}

void add_options(CLI::App& app, Options& options) {
  add_file_options(app, options);
  add_tracing_options(app, options);
}

/// Checks that involve several options.
void check_options(const Options& options) {
  if (options.hits.empty() && !options.explained) throw CLI::RequiredError("--hits (or --explain)");
  if (options.explained && value_of(kDeviceChoices, options.device) == DeviceChoice::kGpu)
    throw CLI::ValidationError("--explain traces the ray on the CPU: use --device auto or cpu");
  if (value_of(kTriangleTests, options.triangle_test) == TriangleTestKind::kReference &&
      value_of(kBoxTests, options.box_test) != BoxTestKind::kConservative)
    throw CLI::ValidationError(
        "--triangle-test reference is with --box-test conservative: with plain boxes hits would be lost");
}

struct Timing {
  std::vector<double> seconds;  ///< Of each repeat, in order.
  double median = 0;
};

double median_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

/// A batch of rays, and how to trace it.
struct Work {
  const SceneView& scene;
  Query query;
  TracePolicies policies;
  std::span<const Ray> rays;
  std::span<Hit> hits;
  std::span<std::uint32_t> paths;  ///< scene.levels per ray.
};

/// @return seconds.
build::Result<double> trace_on_cpu(const Work& work, const ThreadLimit& limit,
                                   const std::function<void(double)>& progress) {
  const auto start = std::chrono::steady_clock::now();
  const std::size_t levels = work.scene.levels;
  const auto trace_batch = [&](std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    trace(work.scene, work.query, work.policies, work.rays.subspan(begin, count), work.hits.subspan(begin, count), {},
          work.paths.subspan(begin * levels, count * levels));
  };
  if (!parallel_batches(work.rays.size(), kBatch, limit, trace_batch, progress))
    return tl::unexpected(build::Error{build::ErrorCode::kCancelled, "cancelled"});
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

build::Result<Timing> trace_all(const Options& options, const ThreadLimit& limit, std::optional<GpuTracer>& gpu,
                                const Work& work) {
  ProgressBar bar;
  Timing timing;
  for (unsigned i = 0; i < options.repeat; ++i) {
    const auto progress = [&](double done) { bar.update("trace", (i + done) / options.repeat); };
    const auto seconds = gpu ? gpu->trace(work.query, work.policies, work.rays, work.hits, progress, work.paths)
                             : trace_on_cpu(work, limit, progress);
    if (!seconds) return tl::unexpected(seconds.error());
    timing.seconds.push_back(*seconds);
  }
  timing.median = median_of(timing.seconds);
  return timing;
}

struct Outcome {
  Query query;
  std::string device, device_name;
  unsigned threads;
  Timing timing;
  std::size_t rays = 0, found = 0;
  std::uint32_t levels = 0;
};

double mrays_per_second(const Outcome& outcome) {
  return outcome.timing.median > 0 ? static_cast<double>(outcome.rays) / outcome.timing.median * 1e-6 : 0.0;
}

void print(const Cli& cli, const Options& options, const Outcome& outcome) {
  if (!cli.json()) {
    std::cout << std::to_string(outcome.rays) << " rays, " << outcome.found << " hits, "
              << word_of(kQueries, outcome.query) << " hit: " << mrays_per_second(outcome) << " Mrays/s (median of "
              << options.repeat << ", " << outcome.device << " " << outcome.device_name << ")\n";
    return;
  }
  cli.print({{"file", options.path},
             {"rays", outcome.rays},
             {"hits", outcome.found},
             {"levels", outcome.levels},
             {"query", word_of(kQueries, outcome.query)},
             {"triangle_test", options.triangle_test},
             {"box_test", options.box_test},
             {"device", outcome.device},
             {"device_name", outcome.device_name},
             {"threads", outcome.threads},
             {"instruction_set", trace_isa()},
             {"seconds", outcome.timing.seconds},
             {"median_seconds", outcome.timing.median},
             {"mrays_per_second", mrays_per_second(outcome)}});
}

/// Checks that the outputs can be written and are neither inputs nor the same file.
build::Result<void> check_outputs(const Options& options) {
  const std::array inputs{options.path, options.rays};
  if (auto checked = check_output(options.hits, inputs); !checked) return checked;
  if (options.paths.empty()) return {};
  std::error_code ignored;
  if (std::filesystem::weakly_canonical(options.paths, ignored) ==
      std::filesystem::weakly_canonical(options.hits, ignored))
    return tl::unexpected(
        build::Error{build::ErrorCode::kInvalidInput, options.paths + ": --hits and --paths are one file"});
  return check_output(options.paths, inputs);
}

build::Result<void> write_all(const Options& options, const Work& work, Outcome& outcome) {
  const auto records = hit_records(work.scene, work.hits, work.paths);
  if (!records) return tl::unexpected(records.error());
  const auto found = [](const HitRecord& hit) { return hit.primitive != kInvalidId; };
  outcome.found = static_cast<std::size_t>(std::count_if(records->begin(), records->end(), found));
  if (auto written = write_hits(options.hits, *records); !written || options.paths.empty()) return written;
  return write_paths(options.paths, static_cast<std::uint32_t>(outcome.rays), work.scene.levels,
                     path_records(work.scene, work.paths));
}

Query query_of(const Options& options, const RayBatch& batch) {
  const bool any = options.query == "auto" ? batch.any_hit : options.query == "any";
  return any ? Query::kAny : Query::kClosest;
}

TracePolicies policies_of(const Options& options) {
  return {value_of(kTriangleTests, options.triangle_test), value_of(kBoxTests, options.box_test)};
}

/// Scenes with shapes have no tracers for the less accurate tests.
build::Result<void> check_policies(const Options& options, const FileHeader& header) {
  const TracePolicies policies = policies_of(options);
  if ((header.features & feature_bit(Feature::kCustom)) == 0 ||
      (policies.triangle_test != TriangleTestKind::kFast && policies.box_test == BoxTestKind::kConservative))
    return {};
  return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput,
                                     options.path +
                                         ": has spheres or curves, which are traced with --triangle-test watertight or "
                                         "reference and --box-test conservative only"});
}

build::Result<void> explain_one(const Cli& cli, const Options& options, const BufferView& view, const RayBatch& batch) {
  const std::uint64_t number = *options.explained;
  if (number >= batch.rays.size())
    return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput,
                                       options.rays + ": has " + std::to_string(batch.rays.size()) +
                                           " rays, numbered from 0: there is no ray " + std::to_string(number)});
  const Ray& ray = batch.rays[static_cast<std::size_t>(number)];
  const Explanation explanation = explain(make_scene_view(view), query_of(options, batch), policies_of(options), ray);
  const nlohmann::json told = explanation_json(view, ray, explanation);
  if (cli.json())
    cli.print(told);
  else
    std::cout << explanation_text(told);
  return {};
}

build::Result<void> run(const Cli& cli, const Options& options) {
  const InterruptGuard guard;
  const ThreadLimit limit(options.threads);
  if (!options.explained)
    if (auto checked = check_outputs(options); !checked) return checked;
  const auto file = load_bvh(options.path, options.threads);
  if (!file) return tl::unexpected(file.error());
  if (auto checked = check_primitive_counts(options.path, file->view); !checked) return checked;
  if (auto checked = check_traceable(options.path, file->view); !checked) return checked;
  if (auto checked = check_policies(options, *file->view.header); !checked) return checked;
  std::optional<MemoryLimit> reading(std::in_place, options.max_memory);
  auto batch = read_rays(options.rays);
  if (!batch) return tl::unexpected(batch.error());
  reading.reset();
  for (Ray& ray : batch->rays) ray.time = options.time;
  if (options.explained) return explain_one(cli, options, file->view, *batch);
  auto gpu = choose_device(value_of(kDeviceChoices, options.device), file->view, policies_of(options));
  if (!gpu) return tl::unexpected(gpu.error());
  const HostPart host;
  // To prepare a triangle for the host takes about as long as a ray gains by it.
  const bool prepares = !gpu->has_value() && batch->rays.size() >= file->view.header->primitive_count;
  const SceneView scene = prepares ? host.scene(file->view) : make_scene_view(file->view);
  Outcome outcome;
  outcome.query = query_of(options, *batch);
  outcome.rays = batch->rays.size();
  outcome.levels = scene.levels;
  outcome.threads = limit.threads();
  outcome.device = device_word(*gpu);
  outcome.device_name = device_name(*gpu);
  std::vector<Hit> hits(batch->rays.size());
  std::vector<std::uint32_t> paths(batch->rays.size() * scene.levels);
  const Work work{scene, outcome.query, policies_of(options), batch->rays, hits, paths};
  auto timing = trace_all(options, limit, *gpu, work);
  if (!timing) return tl::unexpected(timing.error());
  outcome.timing = std::move(*timing);
  if (auto written = write_all(options, work, outcome); !written) return written;
  print(cli, options, outcome);
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  Cli cli(kInfo);
  add_options(cli.app(), options);
  cli.app().callback([&] { check_options(options); });
  return cli.run(argc, argv, [&] { return run(cli, options); });
}
