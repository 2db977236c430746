/// Predicts how bvhrender scales to many ranks; see --help.

#include "measured_costs.h"

#include <benchmarks/common/flags.h>
#include <benchmarks/common/machine.h>
#include <benchmarks/common/summary.h>

#include <tools/base/interrupt.h>

#include <nlohmann/json.hpp>

#include <fstream>
#include <iostream>
#include <numeric>
#include <sstream>

namespace hiprt::bench {
namespace {

constexpr int kFailure = 1, kUsage = 2;

constexpr std::string_view kDescription =
    R"(bench_ranks: predicts the time of bvhrender --integrator path on many ranks, by a simulation.

usage: bench_ranks --bvh=FILE [FLAG...]

It times each tile of a small picture on one thread, and what rank 0 does for a unit of work. Then it simulates runs of
a large picture: the dealer of bvhrender deals units to ranks that do not exist, in simulated time. Network and MPI are
described by the flags. Starting the ranks and reading the scene are not simulated.
Exit status: 0; 1 when something failed; 2 for a wrong command line.

)";

struct CommandLine {
  std::string bvh, camera, json, ranks = "1,2,4,8,16,32,64,128,256,512,1000";
  unsigned width = 3840, height = 2160, samples = 1024, workers = 16, seed = 36;
  unsigned latency_us = 20, megabytes = 1000, mpi_ns = 2500;
  bool help = false;
};

std::vector<Flag> make_flags(CommandLine& line) {
  return {text_flag("bvh", "FILE", "the scene", line.bvh),
          text_flag("camera", "FILE", "a .cam file (the whole scene is seen)", line.camera),
          text_flag("ranks", "N,...", "numbers of ranks", line.ranks),
          number_flag("workers", "threads of each rank", line.workers, 1, 1024),
          number_flag("width", "width of the picture", line.width, 8, 65536),
          number_flag("height", "height of the picture", line.height, 8, 65536),
          number_flag("samples", "samples per pixel", line.samples, 1, 1'000'000),
          number_flag("latency", "microseconds of a message", line.latency_us, 0, 1'000'000),
          number_flag("mpi", "nanoseconds of rank 0's processor for a message, in MPI", line.mpi_ns, 0, 1'000'000),
          number_flag("bandwidth", "10^6 bytes per second of rank 0's network card, each way", line.megabytes, 1,
                      1'000'000),
          number_flag("seed", "of the units' times", line.seed, 0, 1'000'000'000),
          text_flag("json", "FILE", "writes all figures as JSON", line.json)};
}

int fail(const std::string& message, int status) {
  std::cerr << "bench_ranks: " << message << "\n";
  return status;
}

/// @return nothing if the text is no list of numbers from 1 to 100,000.
std::vector<unsigned> parse_ranks(const std::string& text) {
  std::vector<unsigned> ranks;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) {
    const bool digits = !word.empty() && word.size() <= 6 && word.find_first_not_of("0123456789") == std::string::npos;
    const unsigned long number = digits ? std::stoul(word) : 0;
    if (number < 1 || number > 100'000) return {};
    ranks.push_back(static_cast<unsigned>(number));
  }
  return ranks;
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
  SimulatedRun run;
  double least, efficiency;
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
      {"runs", nlohmann::json::array()}};
  for (const Row& row : rows)
    json["runs"].push_back({{"ranks", row.ranks},
                            {"seconds", row.run.seconds},
                            {"efficiency", row.efficiency},
                            {"least_seconds", row.least},
                            {"dealing_seconds", row.run.dealing},
                            {"card_seconds", row.run.card},
                            {"units", row.run.units},
                            {"bytes", row.run.bytes}});
  return json;
}

std::string to_table(const std::vector<Row>& rows) {
  const std::vector<Column<Row>> columns{
      {"ranks", [](const Row& row) { return std::to_string(row.ranks); }},
      {"seconds", [](const Row& row) { return format_number(row.run.seconds, 1); }},
      {"efficiency", [](const Row& row) { return format_number(row.efficiency, 3); }},
      {"bound, s", [](const Row& row) { return format_number(row.least, 1); }},
      {"rank 0 deals, % of the time",
       [](const Row& row) { return format_number(100.0 * row.run.dealing / row.run.seconds, 1); }},
      {"its card, %", [](const Row& row) { return format_number(100.0 * row.run.card / row.run.seconds, 1); }},
      {"units", [](const Row& row) { return std::to_string(row.run.units); }},
      {"GB", [](const Row& row) { return format_number(1e-9 * static_cast<double>(row.run.bytes), 2); }}};
  return table(rows, columns);
}

int measure(const CommandLine& line, const std::string& command) {
  const std::vector<unsigned> ranks = parse_ranks(line.ranks);
  if (ranks.empty()) return fail("--ranks=" + line.ranks + ": expected numbers from 1 to 100000", kUsage);
  const auto file = open_scene(line.bvh);
  if (!file) return fail(file.error().message, kFailure);
  const auto camera = load_camera(line, *file);
  if (!camera) return fail("--camera: " + camera.error(), kFailure);
  const auto measured = measure_picture(*file, *camera, {});
  if (!measured) return fail(measured.error().message, kFailure);
  RankCosts costs = measure_dealing(measured->pixel_bytes);
  // A unit is a message out and one back.
  costs.unit_seconds += 2e-9 * line.mpi_ns;
  costs.latency = 1e-6 * line.latency_us;
  costs.byte_per_second = 1e6 * line.megabytes;
  const double step = std::accumulate(measured->tile_seconds.begin(), measured->tile_seconds.end(), 0.0);
  std::cout << "Measured: " << format_number(1e6 * step / (measured->grid.width * measured->grid.height), 2)
            << " us per path, deviation " << format_number(measured->deviation, 3)
            << "; rank 0: " << format_number(1e6 * costs.unit_seconds, 2) << " us per unit, "
            << format_number(1e9 * costs.byte_seconds, 3) << " ns per byte, "
            << format_number(1e9 * costs.rank_seconds, 2) << " ns per unit and rank\n\n";
  std::vector<Row> rows;
  for (const unsigned count : ranks) {
    if (tools::interrupted()) return fail("cancelled", kFailure);
    const PictureCosts picture = enlarged(*measured, line.width, line.height, line.samples, count * line.workers);
    Row row{count, simulate(picture, costs, count, line.workers, line.seed), 0.0, 0.0};
    row.least = least_seconds(picture, costs, count, line.workers, row.run.units, row.run.bytes);
    row.efficiency = row.run.worked / (row.run.seconds * count * line.workers);
    rows.push_back(row);
  }
  std::cout << to_table(rows);
  if (line.json.empty()) return 0;
  std::ofstream output(line.json);
  output << to_json(line, command, *measured, costs, rows).dump(1) << "\n";
  return output.flush() ? 0 : fail(line.json + ": cannot be written", kFailure);
}

int run(int argc, char** argv) {
  std::string command = "bench_ranks";
  CommandLine line;
  for (const char* argument : std::span(argv, static_cast<std::size_t>(argc)).subspan(1)) {
    command += std::string(" ") + argument;
    line.help |= std::string_view(argument) == "--help" || std::string_view(argument) == "-h";
  }
  const std::vector<Flag> flags = make_flags(line);
  if (line.help) {
    std::cout << kDescription << describe(flags);
    return 0;
  }
  if (const std::string fault = take_flags(argc, argv, flags); !fault.empty())
    return fail(fault + " (see --help)", kUsage);
  if (argc > 1) return fail("unknown argument '" + std::string(argv[1]) + "' (see --help)", kUsage);
  if (line.bvh.empty()) return fail("--bvh=FILE is missing (see --help)", kUsage);
  const tools::InterruptGuard guard;
  return measure(line, command);
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) { return hiprt::bench::run(argc, argv); }
