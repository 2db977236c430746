/// bvhtrace: traces the rays of a file through a BVH file.

#include <tools/base/digest.h>
#include <tools/base/interrupt.h>
#include <tools/base/memory_limit.h>
#include <tools/base/parallel.h>
#include <tools/cli/bvh_file.h>
#include <tools/cli/cli.h>
#include <tools/cli/progress.h>
#include <tools/cli/ranks/join_ranks.h>
#include <tools/cli/ranks/rank_start.h>
#include <tools/cli/trace/bulk_trace.h>
#include <tools/cli/trace/explain.h>
#include <tools/cli/trace/trace_command.h>
#include <tools/cli/trace/trace_names.h>
#include <tools/cli/trace/trace_records.h>
#include <tools/cli/trace/trace_work.h>
#include <tools/cli/trace_device.h>
#include <tools/scene_io/rays_file.h>

#include <hiprt_build/format/view.h>
#include <hiprt_build/host/host_part.h>
#include <hiprt_device/scene_view.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <iostream>
#include <limits>
#include <memory>
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
    "  rays   u32 count, u32 any-hit flag, count x 8 float32 {origin, tmin, direction, tmax}; the count 0xffffffff\n"
    "         also stands for more rays: as many as the file has\n"
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
    "  mpirun -n 4 bvhtrace scene.bvh --rays all.rays --hits out.hits --resume out.part # in blocks, on four "
    "processes\n"
    "  bvhtrace scene.bvh --rays primary.rays --explain 1234                            # why a ray misses\n"};

struct Timing {
  std::vector<double> seconds;  ///< Of each repeat, in order.
  double median = 0;
};

double median_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

build::Result<Timing> trace_all(const TraceCommand& command, const ThreadLimit& limit, std::optional<GpuTracer>& gpu,
                                const TraceWork& work) {
  ProgressBar bar;
  Timing timing;
  for (unsigned i = 0; i < command.repeat; ++i) {
    const auto progress = [&](double done) { bar.update("trace", (i + done) / command.repeat); };
    const auto seconds = trace_batch(work, gpu, limit, progress);
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
  std::uint64_t rays = 0, found = 0;
  std::uint32_t levels = 0;
  int ranks = 1;
};

double mrays_per_second(const Outcome& outcome) {
  return outcome.timing.median > 0 ? static_cast<double>(outcome.rays) / outcome.timing.median * 1e-6 : 0.0;
}

void print(const Cli& cli, const TraceCommand& command, const Outcome& outcome) {
  if (!cli.json()) {
    std::cout << std::to_string(outcome.rays) << " rays, " << outcome.found << " hits, "
              << word_of(kQueries, outcome.query) << " hit: " << mrays_per_second(outcome) << " Mrays/s (median of "
              << command.repeat << ", " << outcome.device << " " << outcome.device_name
              << (outcome.ranks == 1 ? "" : ", " + std::to_string(outcome.ranks) + " ranks") << ")\n";
    return;
  }
  cli.print({{"file", command.path},
             {"rays", outcome.rays},
             {"hits", outcome.found},
             {"levels", outcome.levels},
             {"query", word_of(kQueries, outcome.query)},
             {"triangle_test", command.triangle_test},
             {"box_test", command.box_test},
             {"device", outcome.device},
             {"device_name", outcome.device_name},
             {"threads", outcome.threads},
             {"ranks", outcome.ranks},
             {"instruction_set", trace_isa()},
             {"seconds", outcome.timing.seconds},
             {"median_seconds", outcome.timing.median},
             {"mrays_per_second", mrays_per_second(outcome)}});
}

build::Result<void> write_all(const TraceCommand& command, const TraceWork& work, Outcome& outcome) {
  const auto records = hit_records(work.scene, work.hits, work.paths);
  if (!records) return tl::unexpected(records.error());
  const auto found = [](const HitRecord& hit) { return hit.primitive != kInvalidId; };
  outcome.found = static_cast<std::uint64_t>(std::count_if(records->begin(), records->end(), found));
  if (auto written = write_hits(command.hits, *records); !written || command.paths.empty()) return written;
  const auto count = std::min<std::uint64_t>(outcome.rays, std::numeric_limits<std::uint32_t>::max());
  return write_paths(command.paths, static_cast<std::uint32_t>(count), work.scene.levels,
                     path_records(work.scene, work.paths));
}

build::Result<void> explain_one(const Cli& cli, const TraceCommand& command, const BufferView& view,
                                const RayBatch& batch) {
  const std::uint64_t number = *command.explained;
  if (number >= batch.rays.size())
    return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput,
                                       command.rays + ": has " + std::to_string(batch.rays.size()) +
                                           " rays, numbered from 0: there is no ray " + std::to_string(number)});
  const Ray& ray = batch.rays[static_cast<std::size_t>(number)];
  const Explanation explanation =
      explain(make_scene_view(view), command.query_of(batch.any_hit), command.policies(), ray);
  const nlohmann::json told = explanation_json(view, ray, explanation);
  if (cli.json())
    cli.print(told);
  else
    std::cout << explanation_text(told);
  return {};
}

/// Whether the tools can trace the file as asked.
build::Result<void> check_scene(const TraceCommand& command, const BufferView& view) {
  if (auto checked = check_primitive_counts(command.path, view); !checked) return checked;
  if (auto checked = check_traceable(command.path, view); !checked) return checked;
  return check_policies(command, *view.header);
}

Outcome outcome_of(const TraceCommand& command, const SceneView& scene, const std::optional<GpuTracer>& gpu,
                   bool any_hit) {
  Outcome outcome;
  outcome.query = command.query_of(any_hit);
  outcome.levels = scene.levels;
  outcome.device = device_word(gpu);
  outcome.device_name = device_name(gpu);
  return outcome;
}

/// To prepare a triangle for the host takes about as long as a ray gains by it.
bool prepares(const std::optional<GpuTracer>& gpu, std::uint64_t rays, const BufferView& view) {
  return !gpu && rays >= view.header->primitive_count;
}

/// Traces all rays at once.
build::Result<void> run_at_once(const Cli& cli, const TraceCommand& command) {
  const ThreadLimit limit(command.threads);
  if (!command.explained)
    if (auto checked = check_outputs(command); !checked) return checked;
  const auto file = load_bvh(command.path, command.max_memory, command.threads);
  if (!file) return tl::unexpected(file.error());
  if (auto checked = check_scene(command, file->view); !checked) return checked;
  std::optional<MemoryLimit> reading(std::in_place, command.max_memory);
  auto batch = read_rays(command.rays);
  if (!batch) return tl::unexpected(batch.error());
  reading.reset();
  for (Ray& ray : batch->rays) ray.time = command.time;
  if (command.explained) return explain_one(cli, command, file->view, *batch);
  auto gpu = choose_device(value_of(kDeviceChoices, command.device), file->view, command.policies());
  if (!gpu) return tl::unexpected(gpu.error());
  const HostPart host;
  const SceneView scene =
      prepares(*gpu, batch->rays.size(), file->view) ? host.scene(file->view) : make_scene_view(file->view);
  Outcome outcome = outcome_of(command, scene, *gpu, batch->any_hit);
  outcome.rays = batch->rays.size();
  outcome.threads = limit.threads();
  std::vector<Hit> hits(batch->rays.size());
  std::vector<std::uint32_t> paths(batch->rays.size() * scene.levels);
  const TraceWork work{scene, outcome.query, command.policies(), batch->rays, hits, paths};
  auto timing = trace_all(command, limit, *gpu, work);
  if (!timing) return tl::unexpected(timing.error());
  outcome.timing = std::move(*timing);
  if (auto written = write_all(command, work, outcome); !written) return written;
  print(cli, command, outcome);
  return {};
}

/// Traces the rays in blocks, with the other ranks.
class BlockRun {
 public:
  BlockRun(const Cli& cli, TraceCommand& command, Ranks& ranks) : cli_(cli), command_(command), ranks_(ranks) {}

  build::Result<void> run() {
    if (ranks_.is_first())
      if (auto checked = check_outputs(command_); !checked) return checked;
    // A fault of another rank reaches rank 0 as the result of its first block.
    const auto scene = prepare();
    if (!scene && ranks_.is_first()) return tl::unexpected(scene.error());
    ProgressBar bar;
    BulkOutput output;
    output.hits = command_.hits;
    output.paths = command_.paths;
    output.resume = command_.resume;
    output.lossy = command_.ranks.lossy;
    output.warn = [&](const std::string& message) { cli_.warn(message); };
    if (ranks_.is_first()) {
      output.key = key();
      output.progress = [&](double done) { bar.update("trace", done); };
    }
    const auto result = trace_in_blocks(ranks_, scene, output);
    bar.clear();
    if (!result) return tl::unexpected(result.error());
    if (ranks_.is_first()) report(*result);
    return {};
  }

 private:
  /// Opens the files and chooses the device. Rank 0 tells the others which.
  build::Result<BulkScene> prepare() {
    GpuChoice gpus;
    auto file = ranks_.is_first() ? lead(gpus) : follow(gpus);
    if (!file) return tl::unexpected(std::move(file.error()));
    file_ = std::move(*file);
    auto rays = RayStream::open(command_.rays);
    if (!rays) return tl::unexpected(std::move(rays.error()));
    rays_ = std::move(*rays);
    auto gpu = choose_device(value_of(kDeviceChoices, command_.device), file_->view, command_.policies(), gpus);
    if (!gpu) return tl::unexpected(std::move(gpu.error()));
    gpu_ = std::move(*gpu);
    const std::uint64_t share = rays_->count() / static_cast<std::uint64_t>(ranks_.size());
    scene_ = prepares(gpu_, share, file_->view) ? host_.scene(file_->view) : make_scene_view(file_->view);
    return BulkScene{scene_,
                     *rays_,
                     command_.query_of(rays_->any_hit()),
                     command_.policies(),
                     command_.time,
                     command_.block.value_or(kDefaultBlock),
                     !command_.paths.empty(),
                     gpu_,
                     command_.threads};
  }

  build::Result<BvhFile> lead(GpuChoice& gpus) {
    if (ranks_.size() == 1) return checked(load_bvh(command_.path, command_.max_memory, command_.threads));
    RankWatch watch(ranks_, command_.ranks.lossy, [&](const std::string& message) { cli_.warn(message); });
    LeadStart start(watch);
    const auto share = start.gather(own_means(ranks_, command_.device != "cpu"));
    if (!share) return tl::unexpected(share.error());
    gpus = take_share(*share, command_.threads);
    // The ranks of a host share the pages of a mapped file.
    auto file = checked(command_.ranks.broadcast ? load_bvh(command_.path, command_.max_memory, command_.threads)
                                                 : map_bvh(command_.path, command_.threads));
    if (file) start.begin(std::as_const(file->buffer).bytes(), {}, command_.ranks.broadcast);
    return file;
  }

  build::Result<BvhFile> follow(GpuChoice& gpus) {
    FollowStart start(ranks_);
    const auto begin = start.begin(own_means(ranks_, command_.device != "cpu"));
    if (!begin) return tl::unexpected(begin.error());
    gpus = take_share(begin->share, command_.threads);
    return start.scene(*begin, command_.path);
  }

  build::Result<BvhFile> checked(build::Result<BvhFile> file) const {
    if (!file) return file;
    if (auto good = check_scene(command_, file->view); !good) return tl::unexpected(std::move(good.error()));
    return file;
  }

  PictureKey key() const {
    const TracePolicies policies = command_.policies();
    return {{"program", tool_version(kInfo)},
            {"scene", to_text(digest_of(file_->view.bytes))},
            {"rays", std::to_string(rays_->count()) + ", changed at " + std::to_string(rays_->changed()) + " ns"},
            {"block", std::to_string(command_.block.value_or(kDefaultBlock))},
            {"query", word_of(kQueries, command_.query_of(rays_->any_hit()))},
            {"triangle-test", word_of(kTriangleTests, policies.triangle_test)},
            {"box-test", word_of(kBoxTests, policies.box_test)},
            {"time", std::to_string(command_.time)},
            {"hits", command_.hits},
            {"paths", command_.paths}};
  }

  void report(const BulkResult& result) const {
    Outcome outcome = outcome_of(command_, scene_, gpu_, rays_->any_hit());
    outcome.rays = rays_->count();
    outcome.found = result.hits;
    outcome.ranks = ranks_.size();
    outcome.threads = ThreadLimit(command_.threads).threads();
    outcome.timing = {{result.seconds}, result.seconds};
    print(cli_, command_, outcome);
  }

  const Cli& cli_;
  TraceCommand& command_;
  Ranks& ranks_;
  std::optional<BvhFile> file_;
  std::optional<RayStream> rays_;
  std::optional<GpuTracer> gpu_;
  HostPart host_;
  SceneView scene_{};
};

build::Result<void> run(const Cli& cli, TraceCommand& command, Ranks& ranks) {
  const InterruptGuard guard;
  if (ranks.size() == 1 && !command.in_blocks()) return run_at_once(cli, command);
  if (command.explained || command.repeat != 1) {
    if (!ranks.is_first()) return {};
    return run_at_once(cli, command);
  }
  auto done = BlockRun(cli, command, ranks).run();
  ranks.stop_others();
  return done;
}

}  // namespace

int main(int argc, char** argv) {
  TraceCommand command;
  Cli cli(kInfo);
  add_trace_options(cli.app(), command);
  std::unique_ptr<Ranks> ranks;
  const int status = cli.run(argc, argv, [&]() -> build::Result<void> {
    if (auto joined = join_ranks(cli, command.ranks.lossy, ranks); !joined) return joined;
    return run(cli, command, *ranks);
  });
  return leave_run(ranks.get(), status);
}
