/// bvhtrace: rays through a BVH file.

#include "bvh_file.h"
#include "cli.h"
#include "parallel.h"
#include "progress.h"
#include "rays_file.h"
#include "trace_device.h"
#include "trace_names.h"

#include <hiprt_device/scene_view.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <iostream>
#include <limits>
#include <optional>
#include <span>

namespace {

using namespace hiprt;
using namespace hiprt::tools;

constexpr ToolInfo kInfo{
    "bvhtrace",
    "Traces a file of rays through a BVH file and writes the hits; reports the speed (on a GPU that of the kernels,\n"
    "without copies). The hits are the same on every device.\n"
    "The BVH file is validated first. Primitives are numbered over all geometries in order. Rays that are not\n"
    "finite, have no direction or an empty range miss. For --query any the hit is the first one that was found.\n"
    "Rays: u32 count, u32 any-hit flag, count x 8 float32 {origin, tmin, direction, tmax}.\n"
    "Hits: count x {float32 t (inf: a miss), u32 primitive (0xffffffff: a miss)}. Both little-endian.",
    "  bvhtrace scene.bvh --rays scene.primary.rays --hits out.hits\n"
    "  bvhtrace scene.bvh --rays shadow.rays --hits out.hits --query any --repeat 9 --threads 1\n"
    "  bvhtrace scene.bvh --rays scene.primary.rays --hits out.hits --device gpu --repeat 9\n"
    "  bvhtrace scene.bvh --rays r.rays --hits out.hits --triangle-test fast --box-test plain --json\n"};

/// Rays that one task traces: long enough to hide the scheduling, short enough to balance.
constexpr std::size_t kBatch = 4096;

struct Options {
  std::string path, rays, hits;
  std::string query = "auto", triangle_test = "watertight", box_test = "conservative", device = "auto";
  unsigned threads = 0, repeat = 1;
};

void add_options(CLI::App& app, Options& options) {
  app.add_option("FILE", options.path, "The BVH file")->required()->type_name("");
  app.add_option("--rays", options.rays, "The rays to trace")->required()->type_name("FILE");
  app.add_option("--hits", options.hits, "The file of hits to write")->required()->type_name("FILE");
  app.add_option("--query", options.query, "auto: as the ray file's any-hit flag says")
      ->check(CLI::IsMember(words(kQueries, {"auto"})))
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option("--triangle-test", options.triangle_test, "fast may miss rays through edges and corners")
      ->check(CLI::IsMember(words(kTriangleTests)))
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option("--box-test", options.box_test, "plain may miss rays that graze a box")
      ->check(CLI::IsMember(words(kBoxTests)))
      ->type_name("NAME")
      ->capture_default_str();
  add_device_option(app, options.device);
  add_threads_option(app, options.threads);
  app.add_option("--repeat", options.repeat, "Trace N times and report the median speed")
      ->check(CLI::Range(1u, 1000000u))
      ->type_name("N")
      ->capture_default_str();
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

/// What is traced, and with what.
struct Work {
  const SceneView& scene;
  Query query;
  TracePolicies policies;
  std::span<const Ray> rays;
  std::span<Hit> hits;
};

/// @return seconds.
build::Result<double> trace_on_cpu(const Work& work, const ThreadLimit& limit,
                                   const std::function<void(double)>& progress) {
  const auto start = std::chrono::steady_clock::now();
  const auto trace_batch = [&](std::size_t begin, std::size_t end) {
    trace(work.scene, work.query, work.policies, work.rays.subspan(begin, end - begin),
          work.hits.subspan(begin, end - begin));
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
    const auto seconds = gpu ? gpu->trace(work.query, work.policies, work.rays, work.hits, progress)
                             : trace_on_cpu(work, limit, progress);
    if (!seconds) return tl::unexpected(seconds.error());
    timing.seconds.push_back(*seconds);
  }
  timing.median = median_of(timing.seconds);
  return timing;
}

build::Result<std::vector<HitRecord>> records_of(const BufferView& view, std::span<const Hit> hits) {
  std::vector<HitRecord> records(hits.size(), HitRecord{std::numeric_limits<float>::infinity(), kInvalidId});
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].failed())
      return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput,
                                         "the scene has features that this tracer was not compiled for"});
    if (!hits[i].found()) continue;
    const std::uint64_t number = view.geometries[hits[i].geometry].first_primitive + hits[i].primitive;
    records[i] = {hits[i].t, static_cast<std::uint32_t>(number)};
  }
  return records;
}

struct Outcome {
  Query query;
  std::string device, device_name;
  unsigned threads;
  Timing timing;
  std::size_t rays = 0, found = 0;
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

/// What a hit file and the kernels can take.
build::Result<void> check_limits(const Options& options, const FileHeader& header) {
  if (header.primitive_count > kInvalidId)
    return tl::unexpected(
        build::Error{build::ErrorCode::kTooLarge, options.path + ": " + std::to_string(header.primitive_count) +
                                                      " primitives, a hit file numbers " + std::to_string(kInvalidId)});
  return check_traceable(options.path, header);
}

build::Result<void> run(const Cli& cli, const Options& options) {
  const InterruptGuard guard;
  const ThreadLimit limit(options.threads);
  const std::array inputs{options.path, options.rays};
  if (auto checked = check_output(options.hits, inputs); !checked) return checked;
  const auto file = load_bvh(options.path);
  if (!file) return tl::unexpected(file.error());
  if (auto checked = check_limits(options, *file->view.header); !checked) return checked;
  const auto batch = read_rays(options.rays);
  if (!batch) return tl::unexpected(batch.error());
  Outcome outcome;
  const bool any = options.query == "auto" ? batch->any_hit : options.query == "any";
  outcome.query = any ? Query::kAny : Query::kClosest;
  outcome.rays = batch->rays.size();
  outcome.threads = limit.threads();
  auto gpu = choose_device(value_of(kDeviceChoices, options.device), file->view);
  if (!gpu) return tl::unexpected(gpu.error());
  outcome.device = device_word(*gpu);
  outcome.device_name = device_name(*gpu);
  std::vector<Hit> hits(batch->rays.size());
  const SceneView scene = make_scene_view(file->view);
  const TracePolicies policies{value_of(kTriangleTests, options.triangle_test), value_of(kBoxTests, options.box_test)};
  auto timing = trace_all(options, limit, *gpu, {scene, outcome.query, policies, batch->rays, hits});
  if (!timing) return tl::unexpected(timing.error());
  outcome.timing = std::move(*timing);
  const auto records = records_of(file->view, hits);
  if (!records) return tl::unexpected(records.error());
  const auto found = [](const HitRecord& hit) { return hit.primitive != kInvalidId; };
  outcome.found = static_cast<std::size_t>(std::count_if(records->begin(), records->end(), found));
  if (auto written = write_hits(options.hits, *records); !written) return written;
  print(cli, options, outcome);
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  Cli cli(kInfo);
  add_options(cli.app(), options);
  return cli.run(argc, argv, [&] { return run(cli, options); });
}
