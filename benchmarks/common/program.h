#pragma once
/// The common part of the main functions of the benchmark programs.

#include "flags.h"

#include <benchmark/benchmark.h>

#include <functional>
#include <string>
#include <vector>

namespace hiprt::bench {

/// The end of a program's output.
struct Summary {
  std::string markdown;             ///< Tables; also written to --markdown=FILE.
  std::vector<std::string> faults;  ///< Wrong results. Any of them makes the exit status 1.
};

struct Program {
  const char* name;
  const char* description;  ///< One or a few lines for --help.
  std::vector<Flag> flags;
  /// Registers the benchmarks, after the flags were parsed. @return an error message, or nothing.
  std::function<std::string()> add_benchmarks;
  /// Called after the benchmarks ran.
  std::function<Summary()> summarize;
};

/// Registers a benchmark that runs once and is reported in seconds.
void add_benchmark(const std::string& name, std::function<void(benchmark::State&)> body);

/// Runs the benchmarks, with all of Google Benchmark's flags except --benchmark_format. Progress goes to stderr, the
/// summary to stdout, and JSON to --benchmark_out.
/// @return 0; 1 when a benchmark failed, a result is wrong or a file could not be written; 2 for a wrong command line.
int run_program(Program program, int argc, char** argv);

/// "GCC 12.2.0".
std::string compiler_name();

}  // namespace hiprt::bench
