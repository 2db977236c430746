/// The evaluation of the HIPRT paper: build time, tree quality, and the rays of a path tracer; see --help.

#include "contest.h"

#include <benchmarks/common/machine.h>
#include <benchmarks/common/program.h>

#include <hiprt_build/embree/rtcore.h>
#include <hiprt_build/file.h>
#include <hiprt_build/format/view.h>
#include <tools/cli/build/build_names.h>
#include <tools/cli/progress.h>
#include <tools/render/tracers/gpu_tracer.h>

#include <sys/utsname.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <iostream>
#include <span>
#include <string_view>

namespace hiprt::bench {
namespace {

constexpr int kFailure = 1, kUsage = 2;

constexpr std::string_view kDescription =
    R"(bench_evaluation: the evaluation of Meister et al., "HIPRT: A Ray Tracing Framework in HIP" (2024).

usage: bench_evaluation [FLAG...]

Measures, per scene, builder and hierarchy, the build time, SAH cost and size of the BVH, and the time of each wave of
rays of a path tracer (one sample per pixel): primary, secondary (diffuse bounces) and shadow rays.
Hierarchies: flat (all instances transformed, in one BVH), two_level (one BVH over instances of objects) and deep (the
scene's groups, if they have more levels). On a CPU Embree traces the same rays in the same process, on a GPU Vulkan
does. --vulkan=fast_trace adds Vulkan on a CPU too: its GPU, or without one a driver that runs on the CPU (lavapipe).
Times on a CPU are those of all threads. Times on a GPU are the GPU's, without copies and allocations; the CPU builds
the BVHs over instances, and the trees of Embree's builders (embree-low, embree-medium, embree-high). All builders run
in turn for several rounds; the medians count.
The program compares all results. Exit status: 0; 1 when something failed or our tracers have other results; 2 for a
wrong command line.

)";

struct CommandLine {
  std::string device = "cpu", json, markdown, commit = HIPRT_BENCH_COMMIT;
  unsigned threads = 0;
  SceneChoice scenes;
  ContestOptions contest;
  VulkanOptions vulkan;
};

std::vector<Flag> make_flags(CommandLine& line) {
  ContestOptions& contest = line.contest;
  std::vector<Flag> flags = line.scenes.flags();
  const std::vector<Flag> vulkan = line.vulkan.flags();
  flags.insert(flags.end(), vulkan.begin(), vulkan.end());
  const std::vector<Flag> more{
      device_flag("device that builds and traces (cpu)", line.device),
      words_flag("builders", "lbvh,ploc,hploc,sah,sbvh,hq", contest.builders, tools::words(tools::kBuilders)),
      words_flag("peers", "Embree's modes, on a CPU; all", contest.peers, embree_modes(), "none"),
      words_flag("hierarchies", "all that a scene has", contest.hierarchies, hierarchy_names()),
      number_flag("width", "width of the picture", contest.picture.width, 1, 16384),
      number_flag("height", "height of the picture", contest.picture.height, 1, 16384),
      number_flag("bounces", "diffuse bounces", contest.picture.bounces, 0, 16),
      number_flag("build-rounds", "rounds of builds", contest.build_rounds, 1, 1000),
      number_flag("rounds", "rounds of each wave", contest.rounds, 1, 1000),
      number_flag("threads", "threads of the CPU; 0: all", line.threads, 0, 4096),
      number_flag("most-triangles", "limit of the flat hierarchy; larger scenes are measured with instances only",
                  contest.most_triangles, 1, 2'000'000'000),
      number_flag("most-differing", "rays in a million for which an accurate tracer may have another result",
                  contest.most_differing, 0, 1'000'000),
      text_flag("json", "FILE", "writes all figures as JSON", line.json),
      text_flag("markdown", "FILE", "writes the tables to a file too", line.markdown),
      text_flag("commit", "TEXT", "commit of the sources, for the JSON (the commit when CMake ran)", line.commit)};
  flags.insert(flags.end(), more.begin(), more.end());
  return flags;
}

nlohmann::json machine_json() {
  utsname system{};
  uname(&system);
  std::array<double, 3> load{};
  const int known = getloadavg(load.data(), 3);
  return {{"cpu", cpu_name()},
          {"system", std::string(system.sysname) + " " + system.release},
          {"load_average", known == 3 ? nlohmann::json(load) : nlohmann::json()}};
}

/// @param name of the GPU; empty on a CPU.
nlohmann::json make_context(const CommandLine& line, const std::string& command, const std::string& name,
                            unsigned threads) {
  char date[32] = "";
  const std::time_t now = std::time(nullptr);
  std::strftime(date, sizeof(date), "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&now));
  const ContestOptions& contest = line.contest;
  return {
      {"format", kEvaluationFormat},
      {"commit", line.commit},
      {"command", command},
      {"date", date},
      {"machine", machine_json()},
      {"device",
       {{"kind", line.device},
        {"name", name.empty() ? cpu_name() : name},
        {"threads", threads},
        {"instruction_set", tools::trace_isa()}}},
      {"versions", {{"compiler", compiler_name()}, {"hiprt", build::version()}, {"embree", RTC_VERSION_STRING}}},
      {"picture",
       {{"width", contest.picture.width}, {"height", contest.picture.height}, {"bounces", contest.picture.bounces}}},
      {"rounds", {{"build", contest.build_rounds}, {"trace", contest.rounds}}},
      {"scenes", nlohmann::json::array()},
      {"faults", nlohmann::json::array()}};
}

int fail(const std::string& message, int status) {
  std::cerr << "bench_evaluation: " << message << "\n";
  return status;
}

/// The GPU's name; empty for a CPU. Builds a tracer of one triangle to get it.
build::Result<std::string> device_name(const CommandLine& line) {
  if (line.device == "cpu") return std::string();
  const std::array<build::Position, 3> positions{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  const std::array<build::Triangle, 1> triangles{{{0, 1, 2}}};
  const build::TriangleMesh mesh{.positions = positions, .triangles = triangles};
  const auto bvh = build::build({&mesh, 1});
  if (!bvh) return tl::unexpected(bvh.error());
  const auto tracer = tools::GpuTracer::make(*open_buffer(bvh->buffer.bytes()));
  if (!tracer) return tl::unexpected(build::Error{tracer.error().code, "--device=gpu: " + tracer.error().message});
  return tracer->device_name();
}

build::Result<void> write_text(const std::string& path, const std::string& text) {
  if (path.empty()) return {};
  return build::write_file(path, std::as_bytes(std::span(text)));
}

/// Opens Vulkan's device if the command line asks for one. Without a device it prints the reason.
void add_vulkan(CommandLine& line, Machine& machine) {
  auto opened = open_chosen(line.vulkan, machine.gpu);
  line.contest.vulkan = line.vulkan.modes;
  if (opened) {
    machine.vulkan = std::move(*opened);
    return;
  }
  machine.why_no_vulkan = opened.error().message;
  std::cerr << "bench_evaluation: Vulkan is not measured: " << machine.why_no_vulkan << "\n";
}

/// Writes all results after each scene, so that an interruption loses no finished scene.
build::Result<void> add_scene(const CommandLine& line, const SceneRecord& scene, nlohmann::json& json,
                              std::string& markdown) {
  json["scenes"].push_back(to_json(scene));
  for (const std::string& fault : scene.faults) {
    std::cerr << "bench_evaluation: wrong results: " << fault << "\n";
    json["faults"].push_back(fault);
  }
  const std::string text = to_markdown(scene);
  std::cout << text << std::flush;
  markdown += text;
  if (auto written = write_text(line.json, json.dump(1) + "\n"); !written) return written;
  return write_text(line.markdown, markdown);
}

int measure(CommandLine& line, const std::string& command) {
  const auto names = find_source_scenes(line.scenes);
  if (!names) return fail(names.error().message, kUsage);
  for (const std::string& path : {line.json, line.markdown})
    if (const auto can = path.empty() ? build::Result<void>{} : build::check_writable(path); !can)
      return fail(can.error().message, kFailure);
  const tools::ThreadLimit limit(line.threads);
  const auto gpu = device_name(line);
  if (!gpu) return fail(gpu.error().message, kFailure);
  Machine machine{line.device == "gpu", limit, nullptr, {}};
  add_vulkan(line, machine);
  nlohmann::json json = make_context(line, command, *gpu, limit.threads());
  if (machine.vulkan != nullptr) json["vulkan"] = machine.vulkan->describe();
  std::string markdown;
  for (const std::string& name : *names) {
    tools::ProgressBar bar;
    bar.update((name + ": read").c_str(), 0);
    const auto scene = load_source_scene(line.scenes, name);
    if (!scene) return fail(scene.error().message, kFailure);
    const auto record = run_contest(**scene, line.contest, machine, [&](const char* step, double done) {
      bar.update((name + ": " + step).c_str(), done);
    });
    bar.clear();
    if (!record) return fail(record.error().message, kFailure);
    if (auto added = add_scene(line, *record, json, markdown); !added) return fail(added.error().message, kFailure);
  }
  return json["faults"].empty() ? 0 : kFailure;
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) {
  using namespace hiprt::bench;
  CommandLine line;
  return run_with_flags("bench_evaluation", kDescription, make_flags(line), argc, argv,
                        [&](const std::string& command) { return measure(line, command); });
}
