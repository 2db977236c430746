/// Speed of the variants of the traversal; see --help.

#include "../common/flags.h"
#include "report.h"

#include <hiprt_build/file.h>

#include <sys/utsname.h>

#include <algorithm>
#include <ctime>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>

namespace hiprt::bench {
namespace {

constexpr int kFailure = 1, kUsage = 2;

constexpr std::string_view kDescription =
    R"(bench_variants: million rays per second of every compiled variant of the traversal, on a GPU or a CPU thread.

usage: bench_variants --scenes=DIR [FLAG...]
       bench_variants --bvh=FILE,... [--rays=FILE,...] [FLAG...]
       bench_variants --list [FLAG...]

DIR holds SCENE.TREE.bvh (any trees of a scene, any layouts) and SCENE.KIND.rays; a scene without rays gets primary, ao,
shadow and diffuse rays of its camera. Scenes with custom primitives have their boxes in SCENE.boxes. Any-hit queries
trace the any-hit kinds of rays; closest-hit and all-hits queries the others.

The program checks the results. Variants with the tests accurate or watertight-hardware (AMD's ray instruction for
boxes) must agree to the last bit with each other, and with the host on a sample of rays. For all hits it compares
their number, primitives and distances. For the other tests it prints the share of the sample that hits other
primitives than on the host. Variants for AMD's ray instruction exist on GPUs that have it.
Exit status: 0; 1 when something failed or an exact variant has other results; 2 for a wrong command line.

)";

struct CommandLine {
  std::string device, scenes_folder, camera, pixels = "rows", json, markdown, vulkan_json, commit = HIPRT_BENCH_COMMIT;
  std::vector<std::string> scenes, trees, rays;
  unsigned cpu_rays = 200'000;
  bool list = false, help = false;
  SessionOptions session;
  VulkanOptions vulkan;
};

std::vector<Flag> make_flags(CommandLine& line) {
  SessionOptions& session = line.session;
  session.values.resize(kAxes.size());
  std::vector<Flag> flags{
      text_flag("device", "gpu|cpu", "device that traces (gpu if there is one)", line.device),
      text_flag("scenes", "DIR", "folder of trees and rays", line.scenes_folder),
      list_flag("scene", "NAME,...", "scenes of that folder (all)", line.scenes),
      list_flag("bvh", "FILE,...", "trees of one scene", line.trees),
      list_flag("rays", "FILE,...", "rays for all trees (the files beside each tree)", line.rays),
      list_flag("kinds", "KIND,...", "kinds of rays (all)", session.kinds),
      text_flag("camera", "FILE", "camera of generated rays (automatic)", line.camera),
      number_flag("width", "width of the picture of generated rays", session.picture.width, 1, 16384),
      number_flag("height", "height of the picture of generated rays", session.picture.height, 1, 16384),
      text_flag("pixels", "rows|tiles", "order of generated rays: row by row, or in tiles of 8 x 4 pixels (rows)",
                line.pixels),
      number_flag("repetitions", "timed launches", session.repetitions.timed, 1, 1000),
      number_flag("warm-up", "launches before the timed ones", session.repetitions.warm_up, 0, 1000),
      number_flag("cpu-rays", "rays of each kind on a CPU, about", line.cpu_rays, 1, 1u << 30),
      text_flag("json", "FILE", "writes all figures as JSON", line.json),
      text_flag("markdown", "FILE", "writes the tables to a file too", line.markdown),
      text_flag("vulkan-json", "FILE", "measures Vulkan too, and writes its speeds in the form of benchmarks/peers",
                line.vulkan_json),
      text_flag("commit", "TEXT", "commit of the sources, for the JSON (the commit when CMake ran)", line.commit),
  };
  for (Flag& flag : line.vulkan.flags()) flags.push_back(std::move(flag));
  for (std::size_t i = 0; i < kAxes.size(); ++i)
    flags.push_back(
        list_flag(kAxes[i].flag, "VALUE,...", "only variants with these values (all; see --list)", session.values[i]));
  return flags;
}

/// Removes --list and --help, which have no value, from the command line.
void take_words(CommandLine& line, int& argc, char** argv) {
  char** end = std::remove_if(argv + 1, argv + argc, [&](const char* argument) {
    const std::string_view word = argument;
    line.list |= word == "--list";
    line.help |= word == "--help" || word == "-h";
    return word == "--list" || word == "--help" || word == "-h";
  });
  argc = static_cast<int>(end - argv);
}

/// @return an error message, or nothing.
std::string check_values(const Engine& engine, const SessionOptions& options) {
  for (std::size_t i = 0; i < kAxes.size(); ++i)
    for (const std::string& value : options.values[i]) {
      const bool known = std::any_of(engine.variants().begin(), engine.variants().end(),
                                     [&](const Variant& variant) { return variant.name.*kAxes[i].value == value; });
      if (!known) return "--" + std::string(kAxes[i].flag) + "=" + value + ": no compiled variant has it (see --list)";
    }
  return {};
}

build::Result<std::unique_ptr<Engine>> make_engine(const CommandLine& line) {
  if (line.device == "cpu") return make_cpu_engine(line.cpu_rays);
  auto engine = make_gpu_engine();
  if (engine || line.device == "gpu" || engine.error().code != build::ErrorCode::kNoDevice) return engine;
  std::cerr << "bench_variants: on the CPU: " << engine.error().message << "\n";
  return make_cpu_engine(line.cpu_rays);
}

build::Result<void> choose_files(CommandLine& line) {
  line.session.trees.assign(line.trees.begin(), line.trees.end());
  line.session.ray_files.assign(line.rays.begin(), line.rays.end());
  line.session.camera_file = line.camera;
  if (line.scenes_folder.empty()) return {};
  auto found = find_trees(line.scenes_folder, line.scenes);
  if (!found) return tl::unexpected(found.error());
  line.session.trees.insert(line.session.trees.end(), found->begin(), found->end());
  return {};
}

nlohmann::json make_context(const CommandLine& line, const std::string& command) {
  utsname system{};
  uname(&system);
  char date[32] = "";
  const std::time_t now = std::time(nullptr);
  std::strftime(date, sizeof(date), "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&now));
  return {{"commit", line.commit},
          {"command", command},
          {"date", date},
          {"machine", {{"host", system.nodename}, {"system", std::string(system.sysname) + " " + system.release}}}};
}

bool write_text(const std::string& path, const std::string& text) {
  if (path.empty()) return true;
  const auto written = build::write_file(path, std::as_bytes(std::span(text)));
  if (!written) std::cerr << "bench_variants: " << written.error().message << "\n";
  return written.has_value();
}

int fail(const std::string& message, int status) {
  std::cerr << "bench_variants: " << message << "\n";
  return status;
}

/// Opens Vulkan's device if the command line asks for one. Without a device it prints the reason.
std::unique_ptr<VulkanPeers> open_vulkan_peers(const Engine& engine, CommandLine& line) {
  if (line.vulkan_json.empty()) return nullptr;
  auto machine = open_chosen(line.vulkan, engine.describe()["kind"] == "gpu");
  if (machine && *machine != nullptr) return std::make_unique<VulkanPeers>(std::move(*machine), line.vulkan.modes);
  std::cerr << "bench_variants: Vulkan is not measured: "
            << (machine ? "on a CPU --vulkan must name its modes" : machine.error().message) << "\n";
  return nullptr;
}

/// @return whether the file was written, if there are figures for it.
bool write_peers(const VulkanPeers* peers, const CommandLine& line, const nlohmann::json& context) {
  if (peers == nullptr) return true;
  for (const std::string& note : peers->notes()) std::cerr << "bench_variants: " << note << "\n";
  return peers->empty() ||
         write_text(line.vulkan_json, peers->to_json(context, line.session.repetitions).dump(1) + "\n");
}

int measure(Engine& engine, CommandLine& line, const std::string& command) {
  if (auto chosen = choose_files(line); !chosen) return fail(chosen.error().message, kFailure);
  const nlohmann::json context = make_context(line, command);
  const std::unique_ptr<VulkanPeers> vulkan = open_vulkan_peers(engine, line);
  line.session.vulkan = vulkan.get();
  const auto report =
      run_session(engine, line.session, [](const std::string& text) { std::cerr << text << std::endl; });
  if (!report) return fail(report.error().message, kFailure);
  const std::string text = tables(engine, *report);
  std::cout << text << std::flush;
  for (const std::string& fault : report->faults) std::cerr << "bench_variants: wrong result: " << fault << "\n";
  if (!write_text(line.json, to_json(engine, *report, context).dump(1) + "\n") || !write_text(line.markdown, text) ||
      !write_peers(vulkan.get(), line, context))
    return kFailure;
  if (report->results.empty()) return fail("nothing was measured: no variant fits trees, rays and flags", kFailure);
  return report->faults.empty() ? 0 : kFailure;
}

int run(int argc, char** argv) {
  std::string command = "bench_variants";
  for (int i = 1; i < argc; ++i) command += std::string(" ") + argv[i];
  CommandLine line;
  const std::vector<Flag> flags = make_flags(line);
  take_words(line, argc, argv);
  if (const std::string fault = take_flags(argc, argv, flags); !fault.empty())
    return fail(fault + " (see --help)", kUsage);
  if (argc > 1) return fail("unknown argument '" + std::string(argv[1]) + "' (see --help)", kUsage);
  if (line.help) {
    std::cout << kDescription << describe(flags);
    return 0;
  }
  if (!line.device.empty() && line.device != "gpu" && line.device != "cpu")
    return fail("--device=" + line.device + ": expected gpu or cpu", kUsage);
  if (line.pixels != "rows" && line.pixels != "tiles")
    return fail("--pixels=" + line.pixels + ": expected rows or tiles", kUsage);
  line.session.picture.order = line.pixels == "tiles" ? PixelOrder::kTiles : PixelOrder::kRows;
  if (!line.list && line.trees.empty() == line.scenes_folder.empty())
    return fail("expected either --scenes or --bvh (see --help)", kUsage);
  auto engine = make_engine(line);
  if (!engine) return fail(engine.error().message, kFailure);
  if (const std::string fault = check_values(**engine, line.session); !fault.empty()) return fail(fault, kUsage);
  if (!line.list) return measure(**engine, line, command);
  std::cout << list_text(**engine, line.session.values);
  return 0;
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) { return hiprt::bench::run(argc, argv); }
