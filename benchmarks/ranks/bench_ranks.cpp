/// Predicts how bvhrender scales to many ranks; see --help.

#include "measured_costs.h"
#include "rank_program.h"

#include <benchmarks/common/flags.h>
#include <benchmarks/common/machine.h>
#include <benchmarks/common/summary.h>

#include <tools/base/interrupt.h>

#include <nlohmann/json.hpp>

#include <fstream>
#include <iostream>
#include <numeric>
#include <optional>
#include <sstream>

namespace hiprt::bench {
namespace {

constexpr std::string_view kDescription =
    R"(bench_ranks: predicts the time of bvhrender --integrator path on many ranks, by a simulation.

usage: bench_ranks --bvh=FILE [FLAG...]
       mpirun -n 2 bench_ranks --bvh=FILE [FLAG...]

It times each tile of a small picture on one thread, and what rank 0 does for a unit of work. Under mpirun it times
messages between ranks 0 and 1, too. Then it simulates runs of a large picture: the dealer of bvhrender deals units to
ranks that do not exist, in simulated time. Flags describe the network. Starting the ranks and reading the scene are not
simulated.
Exit status: 0; 1 when something failed; 2 for a wrong command line.

)";

struct CommandLine {
  std::string bvh, camera, json;
  std::vector<std::string> ranks{"1", "2", "4", "8", "16", "32", "64", "128", "256", "512", "1000"};
  unsigned width = 3840, height = 2160, samples = 1024, workers = 16, seed = 36;
  unsigned latency_us = 20, megabytes = 1000, message_ns = 7500;
};

std::vector<Flag> make_flags(CommandLine& line) {
  return {text_flag("bvh", "FILE", "the scene", line.bvh),
          text_flag("camera", "FILE", "a .cam file (the whole scene is seen)", line.camera),
          list_flag("ranks", "N,...", "numbers of ranks", line.ranks),
          number_flag("workers", "threads of each rank", line.workers, 1, 1024),
          number_flag("width", "width of the picture", line.width, 8, 65536),
          number_flag("height", "height of the picture", line.height, 8, 65536),
          number_flag("samples", "samples per pixel", line.samples, 1, 1'000'000),
          number_flag("latency", "microseconds of a message", line.latency_us, 0, 1'000'000),
          number_flag("message", "nanoseconds of a processor of rank 0 for a message; under mpirun it is measured",
                      line.message_ns, 0, 1'000'000),
          number_flag("bandwidth", "10^6 bytes per second of rank 0's network card, each way", line.megabytes, 1,
                      1'000'000),
          number_flag("seed", "of the units' times", line.seed, 0, 1'000'000'000),
          text_flag("json", "FILE", "writes all figures as JSON", line.json)};
}

int fail(const std::string& message, int status) {
  std::cerr << "bench_ranks: " << message << "\n";
  return status;
}

tl::expected<tools::Camera, std::string> load_camera(const CommandLine& line, const SceneFile& file) {
  if (line.camera.empty())
    return tools::automatic_camera(file.view().header->bounds, static_cast<double>(line.width) / line.height);
  std::ifstream input(line.camera);
  std::ostringstream text;
  text << input.rdbuf();
  if (!input) return tl::unexpected(line.camera + ": cannot be read");
  return tools::parse_camera(text.str());
}

struct Row {
  unsigned ranks;
  unsigned workers;
  SimulatedRun run;

  double least() const { return least_seconds(run, ranks, workers); }
  double efficiency() const { return run.worked / (run.seconds * ranks * workers); }
  /// Of the run's time.
  double percent(double seconds) const { return 100.0 * seconds / run.seconds; }
};

nlohmann::json to_json(const CommandLine& line, const std::string& command, const PictureCosts& picture,
                       const RankCosts& costs, const std::vector<Row>& rows) {
  nlohmann::json json{
      {"format", "hiprt bench_ranks 1"},
      {"command", command},
      {"cpu", cpu_name()},
      {"picture", {{"width", line.width}, {"height", line.height}, {"samples", line.samples}}},
      {"tile_seconds", picture.tile_seconds},
      {"deviation", picture.deviation},
      {"dealing", {{"unit", costs.unit_seconds}, {"byte", costs.byte_seconds}, {"rank", costs.rank_seconds}}},
      {"message", costs.message_seconds},
      {"runs", nlohmann::json::array()}};
  for (const Row& row : rows)
    json["runs"].push_back({{"ranks", row.ranks},
                            {"seconds", row.run.seconds},
                            {"efficiency", row.efficiency()},
                            {"least_seconds", row.least()},
                            {"dealing_seconds", row.run.dealing},
                            {"messaging_seconds", row.run.messaging},
                            {"card_seconds", row.run.card},
                            {"units", row.run.units},
                            {"bytes", row.run.bytes}});
  return json;
}

std::string to_table(const std::vector<Row>& rows) {
  const std::vector<Column<Row>> columns{
      {"ranks", [](const Row& row) { return std::to_string(row.ranks); }},
      {"seconds", [](const Row& row) { return format_number(row.run.seconds, 1); }},
      {"efficiency", [](const Row& row) { return format_number(row.efficiency(), 3); }},
      {"bound, s", [](const Row& row) { return format_number(row.least(), 1); }},
      {"rank 0 deals, %", [](const Row& row) { return format_number(row.percent(row.run.dealing), 1); }},
      {"is in MPI, %", [](const Row& row) { return format_number(row.percent(row.run.messaging), 1); }},
      {"its card, %", [](const Row& row) { return format_number(row.percent(row.run.card), 1); }},
      {"units", [](const Row& row) { return std::to_string(row.run.units); }},
      {"GB", [](const Row& row) { return format_number(1e-9 * static_cast<double>(row.run.bytes), 2); }}};
  return table(rows, columns);
}

/// @param message_seconds as measured; nothing: the flag's.
int measure(const CommandLine& line, const std::string& command, std::optional<double> message_seconds) {
  const auto ranks = parse_ranks(line.ranks, 100'000);
  if (!ranks) return fail(ranks.error().message, kUsage);
  const auto file = open_scene(line.bvh);
  if (!file) return fail(file.error().message, kFailure);
  const auto camera = load_camera(line, *file);
  if (!camera) return fail("--camera: " + camera.error(), kFailure);
  const auto measured = measure_picture(*file, *camera, {});
  if (!measured) return fail(measured.error().message, kFailure);
  RankCosts costs = measure_dealing(measured->pixel_bytes);
  costs.message_seconds = message_seconds.value_or(1e-9 * line.message_ns);
  costs.latency = 1e-6 * line.latency_us;
  costs.byte_per_second = 1e6 * line.megabytes;
  const double step = std::accumulate(measured->tile_seconds.begin(), measured->tile_seconds.end(), 0.0);
  std::cout << "Measured: " << format_number(1e6 * step / (measured->grid.width * measured->grid.height), 2)
            << " us per path, deviation " << format_number(measured->deviation, 3)
            << "; rank 0: " << format_number(1e6 * costs.unit_seconds, 2) << " us per unit, "
            << format_number(1e9 * costs.byte_seconds, 3) << " ns per byte, "
            << format_number(1e9 * costs.rank_seconds, 2) << " ns per unit and rank. "
            << (message_seconds ? "Measured: " : "Given: ") << format_number(1e6 * costs.message_seconds, 2)
            << " us per message\n\n";
  std::vector<Row> rows;
  for (const unsigned count : *ranks) {
    if (tools::interrupted()) return fail("cancelled", kFailure);
    const PictureCosts picture = enlarged(*measured, line.width, line.height, line.samples, count * line.workers);
    rows.push_back({count, line.workers, simulate(picture, costs, count, line.workers, line.seed)});
  }
  std::cout << to_table(rows);
  if (line.json.empty()) return 0;
  std::ofstream output(line.json);
  output << to_json(line, command, *measured, costs, rows).dump(1) << "\n";
  return output.flush() ? 0 : fail(line.json + ": cannot be written", kFailure);
}

int run(const CommandLine& line, const std::string& command) {
  if (line.bvh.empty()) return fail("--bvh=FILE is missing (see --help)", kUsage);
  std::optional<double> message_seconds;
  const auto measure_wire = [&](tools::Ranks& ranks) -> build::Result<void> {
    // The pixels of a tile of 8 x 8, with 32 bytes each, and a header.
    constexpr std::size_t kBytes = 2080;
    if (ranks.size() == 1) return {};
    const auto seconds = measure_messages(ranks, kBytes);
    if (!seconds) return tl::unexpected(seconds.error());
    message_seconds = *seconds;
    return {};
  };
  return run_on_ranks(fail, measure_wire, [&] { return measure(line, command, message_seconds); });
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) {
  using namespace hiprt::bench;
  CommandLine line;
  return run_with_flags("bench_ranks", kDescription, make_flags(line), argc, argv,
                        [&](const std::string& command) { return run(line, command); });
}
