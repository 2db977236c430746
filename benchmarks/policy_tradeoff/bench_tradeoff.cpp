/// Speed, faults and errors of every policy set; see --help.

#include "session.h"

#include <benchmarks/common/flags.h>
#include <benchmarks/common/program.h>

#include <hiprt_build/file.h>
#include <tools/base/interrupt.h>

#include <algorithm>
#include <ctime>
#include <iostream>

namespace hiprt::bench {
namespace {

constexpr int kFailure = 1, kUsage = 2;

constexpr std::string_view kDescription =
    R"(bench_tradeoff: speed, faults and errors of every policy set.

usage: bench_tradeoff [FLAG...]

Measures every policy set, with and without fast-math, on a CPU Embree too, and on a GPU Vulkan (speed and leaks), on
one device in one run:
- speed: closest hits of primary and diffuse rays, in turn, for several rounds;
- leaks: rays from inside closed meshes that miss, random or aimed at edges and vertices;
- hits that boxes hide;
- self-intersections of spawned rays;
- misses, wrong surfaces and errors of t, u, v and the hit point, compared with exact arithmetic, also through
  instances and in motion.
Exit status: 0; 1 when something failed, or the default or reference policies break a guarantee; 2 for a wrong
command line.

)";

struct CommandLine {
  std::string device = "cpu", json, markdown, commit = HIPRT_BENCH_COMMIT;
  unsigned threads = 0;
  std::vector<std::string> policies;
  SessionOptions session;
  VulkanOptions vulkan;
};

std::vector<Flag> make_flags(CommandLine& line) {
  std::vector<Flag> flags = line.session.scenes.flags();
  const std::vector<Flag> more{
      device_flag("device that traces (cpu)", line.device),
      list_flag("policies", "NAME,...", "policy sets by their names in the tables (all)", line.policies),
      words_flag("questions", "all", line.session.questions, question_names()),
      number_flag("aimed", "thousands of rays per check", line.session.aimed_thousands, 1, 100'000'000),
      number_flag("error-rays", "rays per case that are compared with exact arithmetic", line.session.error_rays, 10,
                  1'000'000),
      number_flag("speed-rays", "rays of each kind that are timed, about", line.session.speed_rays, 100, 100'000'000),
      number_flag("rounds", "rounds of speed", line.session.rounds, 1, 1000),
      number_flag("threads", "threads of the CPU; 0: all", line.threads, 0, 4096),
      text_flag("json", "FILE", "writes all figures as JSON", line.json),
      text_flag("markdown", "FILE", "writes the tables to a file too", line.markdown),
      text_flag("commit", "TEXT", "commit of the sources, for the JSON (the commit when CMake ran)", line.commit)};
  const std::vector<Flag> vulkan = line.vulkan.flags();
  flags.insert(flags.end(), vulkan.begin(), vulkan.end());
  flags.insert(flags.end(), more.begin(), more.end());
  return flags;
}

int fail(const std::string& message, int status) {
  std::cerr << "bench_tradeoff: " << message << "\n";
  return status;
}

/// @return the subjects that the command line names, or the first unknown name.
tl::expected<std::vector<Subject>, std::string> chosen_subjects(const CommandLine& line, const Engine& engine) {
  if (line.policies.empty()) return engine.subjects();
  std::vector<Subject> chosen;
  for (const std::string& name : line.policies) {
    const auto& all = engine.subjects();
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Subject& subject) { return subject.name == name; });
    if (found == all.end()) return tl::unexpected(name);
    chosen.push_back(*found);
  }
  return chosen;
}

build::Result<void> write_text(const std::string& path, const std::string& text) {
  if (path.empty()) return {};
  return build::write_file(path, std::as_bytes(std::span(text)));
}

/// Without a device it prints the reason.
VulkanScenes open_vulkan_scenes(CommandLine& line, const tools::ThreadLimit& limit) {
  auto machine = open_chosen(line.vulkan, line.device == "gpu");
  if (machine) return {std::move(*machine), line.vulkan.modes, limit};
  std::cerr << "bench_tradeoff: Vulkan is not measured: " << machine.error().message << "\n";
  return {nullptr, {}, limit};
}

int measure(CommandLine& line, const std::string& command) {
  for (const std::string& path : {line.json, line.markdown})
    if (const auto can = path.empty() ? build::Result<void>{} : build::check_writable(path); !can)
      return fail(can.error().message, kFailure);
  const tools::ThreadLimit limit(line.threads);
  auto engine = Engine::make(line.device, line.threads, open_vulkan_scenes(line, limit));
  if (!engine) return fail("--device=" + line.device + ": " + engine.error().message, kFailure);
  auto subjects = chosen_subjects(line, **engine);
  if (!subjects)
    return fail("--policies: no policy set '" + subjects.error() + "' (the tables list the names)", kUsage);
  const tools::InterruptGuard guard;
  const auto record = run_session(**engine, std::move(*subjects), line.session);
  if (!record) return fail(record.error().message, kFailure);
  char date[32] = "";
  const std::time_t now = std::time(nullptr);
  std::strftime(date, sizeof(date), "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&now));
  const std::vector<std::string> broken = broken_guarantees(*record);
  nlohmann::json json{
      {"format", kTradeoffFormat},       {"commit", line.commit},       {"command", command},         {"date", date},
      {"device", (*engine)->describe()}, {"compiler", compiler_name()}, {"broken_guarantees", broken}};
  if (const nlohmann::json vulkan = (*engine)->describe_vulkan(); !vulkan.is_null()) json["vulkan"] = vulkan;
  add_json(*record, json);
  const std::string text = to_markdown(*record);
  std::cout << text << std::flush;
  for (const auto& written : {write_text(line.json, json.dump(1) + "\n"), write_text(line.markdown, text)})
    if (!written) return fail(written.error().message, kFailure);
  for (const std::string& fault : broken) std::cerr << "bench_tradeoff: a guarantee is broken: " << fault << "\n";
  return broken.empty() ? 0 : kFailure;
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) {
  using namespace hiprt::bench;
  CommandLine line;
  std::string command;
  for (int i = 0; i < argc; ++i) command += (i == 0 ? "" : " ") + std::string(argv[i]);
  std::vector<Flag> flags = make_flags(line);
  for (int i = 1; i < argc; ++i)
    if (std::string_view(argv[i]) == "--help" || std::string_view(argv[i]) == "-h") {
      std::cout << kDescription << describe(flags);
      return 0;
    }
  if (const std::string fault = take_flags(argc, argv, flags); !fault.empty()) return fail(fault, kUsage);
  if (argc > 1) return fail("unknown argument '" + std::string(argv[1]) + "' (see --help)", kUsage);
  return measure(line, command);
}
