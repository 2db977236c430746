/// Predicts how bvhrender of a scene in parts scales to many ranks; see --help.

#include "measured_costs.h"
#include "part_costs.h"
#include "rank_program.h"

#include <benchmarks/common/flags.h>
#include <benchmarks/common/machine.h>
#include <benchmarks/common/summary.h>

#include <tools/base/interrupt.h>
#include <tools/cli/render/render_command.h>
#include <tools/parts/part_owners.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <fstream>
#include <iostream>

namespace hiprt::bench {
namespace {

constexpr std::string_view kDescription =
    R"(bench_part_ranks: predicts the time of bvhrender of a scene in parts on many ranks, by a simulation.

usage: bench_part_ranks --bvhrender="parts/city.json --integrator path --size 480x270 --spp 64" [FLAG...]
       mpirun -n 2 bench_part_ranks --bvhrender=WORDS [FLAG...]

It renders a few samples of the picture on one thread that has all parts, times them, and notes which parts the rays
visit. Under mpirun it times messages between ranks 0 and 1, too. Then it simulates runs: the dealer of bvhrender deals
units to ranks that do not exist, and their rays visit the same parts, in simulated time. Flags describe the network.
Starting the ranks and reading the parts are not simulated.
Exit status: 0; 1 when something failed; 2 for a wrong command line.

)";

struct CommandLine {
  std::string words, json;
  std::vector<std::string> ranks{"1", "2", "4", "8", "16"};
  unsigned threads = 1, steps = 8, width = 0, height = 0, samples = 0;
  unsigned latency_us = 0, megabytes = 1000, message_ns = 20000, hop_us = 120;
};

std::vector<Flag> make_flags(CommandLine& line) {
  return {text_flag("bvhrender", "WORDS", "the words of bvhrender, without -o", line.words),
          list_flag("ranks", "N,...", "numbers of ranks", line.ranks),
          number_flag("threads", "threads of each rank", line.threads, 1, 1024),
          number_flag("steps", "samples per pixel that are measured", line.steps, 1, 4096),
          number_flag("width", "width of the simulated picture (0: that of --bvhrender)", line.width, 0, 65536),
          number_flag("height", "its height", line.height, 0, 65536),
          number_flag("samples", "its samples per pixel", line.samples, 0, 1'000'000),
          number_flag("hop", "microseconds of a message between waiting threads; under mpirun it is measured",
                      line.hop_us, 0, 1'000'000),
          number_flag("latency", "microseconds that the network adds", line.latency_us, 0, 1'000'000),
          number_flag("message", "nanoseconds of a processor for a message; under mpirun it is measured",
                      line.message_ns, 0, 1'000'000),
          number_flag("bandwidth", "10^6 bytes per second of each rank's network card, each way", line.megabytes, 1,
                      1'000'000),
          text_flag("json", "FILE", "writes all figures as JSON", line.json)};
}

int fail(const std::string& message, int status) {
  std::cerr << "bench_part_ranks: " << message << "\n";
  return status;
}

/// What messages cost, as measured between two ranks.
struct MessageCosts {
  double seconds, byte, latency, waiting;
};

/// All ranks call this. @return nothing: this program was started alone.
build::Result<std::optional<MessageCosts>> measure_wire(tools::Ranks& ranks) {
  constexpr std::size_t kSmall = 64, kLarge = 65536;
  if (ranks.size() == 1) return std::nullopt;
  const auto small = measure_messages(ranks, kSmall);
  if (!small) return tl::unexpected(small.error());
  const auto large = measure_messages(ranks, kLarge);
  if (!large) return tl::unexpected(large.error());
  const auto single = measure_single_messages(ranks);
  if (!single) return tl::unexpected(single.error());
  const double byte = std::max(0.0, *large - *small) / static_cast<double>(kLarge - kSmall);
  return MessageCosts{single->seconds, byte, single->latency, single->waiting};
}

struct Row {
  PartRun run;
  SimulatedPartRun simulated;
  double alone;

  double threads() const { return static_cast<double>(run.ranks) * run.threads; }
  double efficiency() const { return alone / (simulated.seconds * threads()); }
  double work() const { return simulated.worked / threads(); }
  double busiest() const { return simulated.busiest / run.threads; }
  double per_ray(double what) const { return what / simulated.rays; }
};

std::string to_table(const std::vector<Row>& rows) {
  const std::vector<Column<Row>> columns{
      {"ranks", [](const Row& row) { return std::to_string(row.run.ranks); }},
      {"seconds", [](const Row& row) { return format_number(row.simulated.seconds, 2); }},
      {"efficiency", [](const Row& row) { return format_number(row.efficiency(), 3); }},
      {"all work, s", [](const Row& row) { return format_number(row.work(), 2); }},
      {"busiest owner, s", [](const Row& row) { return format_number(row.busiest(), 2); }},
      {"card, s", [](const Row& row) { return format_number(row.simulated.card, 2); }},
      {"visits per ray", [](const Row& row) { return format_number(row.per_ray(row.simulated.sent), 2); }},
      {"bytes per ray", [](const Row& row) { return format_number(row.per_ray(row.simulated.bytes), 0); }},
      {"messages per 1000 rays",
       [](const Row& row) { return format_number(1000.0 * row.per_ray(row.simulated.messages), 1); }}};
  return table(rows, columns);
}

nlohmann::json to_json(const std::string& command, const ExchangeCosts& costs, const std::vector<Row>& rows) {
  nlohmann::json json{
      {"format", "hiprt bench_part_ranks 1"}, {"command", command},         {"cpu", cpu_name()},
      {"home_ray", costs.home_ray},           {"home_hit", costs.home_hit}, {"owner_ray", costs.owner_ray},
      {"owner_hit", costs.owner_hit},         {"parcel", costs.parcel},     {"message_seconds", costs.message_seconds},
      {"message_byte", costs.message_byte},   {"waiting", costs.waiting},   {"latency", costs.latency},
      {"runs", nlohmann::json::array()}};
  for (const Row& row : rows)
    json["runs"].push_back({{"ranks", row.run.ranks},
                            {"seconds", row.simulated.seconds},
                            {"efficiency", row.efficiency()},
                            {"work_seconds", row.work()},
                            {"busiest_seconds", row.busiest()},
                            {"card_seconds", row.simulated.card},
                            {"rays", row.simulated.rays},
                            {"visits_of_other_ranks", row.simulated.sent},
                            {"messages", row.simulated.messages},
                            {"bytes", row.simulated.bytes}});
  return json;
}

/// bvhrender's words.
struct Words {
  CLI::App app{"bvhrender"};
  tools::RenderCommand command;

  /// @return an error message, or nothing.
  std::string parse(const std::string& words) {
    tools::add_render_options(app, command);
    try {
      app.parse("-o picture.png --device cpu --threads 1 " + words);
      command.paths.check(app);
    } catch (const CLI::Error& error) {
      return error.what();
    }
    command.finish();
    return {};
  }
};

struct MeasuredPicture {
  PartPictureCosts picture;
  ParcelCosts parcel{};
};

/// Measures once with large waves, and with such small ones that most parcels have a few rays.
build::Result<MeasuredPicture> measure_picture(tools::RenderCommand& command, const tools::PartScene& scene,
                                               std::uint32_t steps) {
  constexpr std::uint64_t kLittleMemory = 64 << 10;
  const auto camera = tools::choose_camera(command, scene.manifest.bounds());
  if (!camera) return tl::unexpected(camera.error());
  if (auto ready = command.paths.prepare_sky(*camera, command.render, command.outputs); !ready)
    return tl::unexpected(std::move(ready.error()));
  tools::Ranks alone;
  MeasuredPicture measured;
  VisitSums many, few;
  for (const bool is_small : {true, false}) {
    tools::RenderCommand run = command;
    if (is_small) run.ranks.ray_memory = kLittleMemory;
    const auto engine = tools::PartsEngine::make(run, scene, *camera, alone, {});
    if (!engine) return tl::unexpected(engine.error());
    auto picture = measure_parts(**engine, run, is_small ? 1 : steps, is_small ? few : many);
    if (!picture) return tl::unexpected(std::move(picture.error()));
    measured.picture = std::move(*picture);
  }
  measured.parcel = split(many, few);
  // Each ray's share of its parcel is in `parcel` now.
  const double share = many.seconds > 0.0 ? measured.parcel.ray * many.rays / many.seconds : 0.0;
  for (PathCalls& calls : measured.picture.calls)
    for (TraceCall& call : calls.calls)
      for (PartVisits& visits : call.visits) visits.seconds *= share;
  return measured;
}

int predict(const CommandLine& line, const std::string& command, const std::optional<MessageCosts>& wire) {
  const auto counts = parse_ranks(line.ranks, 10'000);
  if (!counts) return fail(counts.error().message, kUsage);
  Words words;
  if (const std::string error = words.parse(line.words); !error.empty()) return fail("--bvhrender: " + error, kUsage);
  const auto scene = tools::read_part_scene(words.command);
  if (!scene) return fail(scene.error().message, kFailure);
  const auto& parts = scene->manifest.parts;
  if (parts.size() > 65535) return fail("more than 65535 parts cannot be simulated", kFailure);
  const auto measured = measure_picture(words.command, *scene, line.steps);
  if (!measured) return fail(measured.error().message, kFailure);
  ExchangeCosts costs = measure_encoding(scene->manifest.levels);
  costs.parcel = measured->parcel.parcel;
  costs.message_seconds = wire ? wire->seconds : 1e-9 * line.message_ns;
  costs.waiting = wire ? wire->waiting : 0.0;
  costs.message_byte = wire ? wire->byte : 0.0;
  costs.latency = (wire ? wire->latency : 1e-6 * line.hop_us) + 1e-6 * line.latency_us;
  costs.byte_per_second = 1e6 * line.megabytes;
  const auto ns = [](double seconds) { return format_number(1e9 * seconds, 1); };
  std::cout << "Measured: rays in messages take " << ns(costs.home_ray) << " ns at home and " << ns(costs.owner_ray)
            << " ns at the owner, surfaces " << ns(costs.home_hit) << " and " << ns(costs.owner_hit)
            << " ns. A visit takes " << ns(costs.parcel) << " ns and each ray " << ns(measured->parcel.ray) << " ns. "
            << (wire ? "Measured: " : "Given: ") << "messages take " << ns(costs.message_seconds) << " ns and "
            << format_number(1e9 * costs.message_byte, 3) << " ns per byte, and are there after "
            << format_number(1e6 * costs.latency, 0) << " us. Looking for them takes "
            << format_number(100.0 * costs.waiting, 1) << " % of a core\n\n";
  const tools::RenderOptions& render = words.command.render;
  const std::uint32_t width = line.width == 0 ? render.width : line.width,
                      height = line.height == 0 ? render.height : line.height,
                      samples = line.samples == 0 ? render.samples : line.samples;
  std::vector<Row> rows;
  for (const unsigned ranks : *counts) {
    if (tools::interrupted()) return fail("cancelled", kFailure);
    const unsigned workers = ranks == 1 ? line.threads : 2 * line.threads;
    const PartPictureCosts picture = enlarged(measured->picture, width, height, samples, ranks * workers);
    const auto memory =
        tools::RayMemory::divide(words.command.ranks.ray_memory, ranks, workers, scene->manifest.levels);
    if (!memory) return fail(memory.error().message, kFailure);
    const PartRun run{tools::owners_of(parts, ranks), ranks, line.threads, static_cast<double>(memory->paths),
                      static_cast<double>(memory->credit)};
    rows.push_back({run, simulate(picture, costs, run), seconds_alone(picture)});
  }
  std::cout << to_table(rows);
  if (line.json.empty()) return 0;
  std::ofstream output(line.json);
  output << to_json(command, costs, rows).dump(1) << "\n";
  return output.flush() ? 0 : fail(line.json + ": cannot be written", kFailure);
}

int run(const CommandLine& line, const std::string& command) {
  if (line.words.empty()) return fail("--bvhrender=WORDS is missing (see --help)", kUsage);
  std::optional<MessageCosts> wire;
  const auto measure = [&](tools::Ranks& ranks) -> build::Result<void> {
    auto measured = measure_wire(ranks);
    if (!measured) return tl::unexpected(std::move(measured.error()));
    wire = *measured;
    return {};
  };
  return run_on_ranks(fail, measure, [&] { return predict(line, command, wire); });
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) {
  using namespace hiprt::bench;
  CommandLine line;
  return run_with_flags("bench_part_ranks", kDescription, make_flags(line), argc, argv,
                        [&](const std::string& command) { return run(line, command); });
}
