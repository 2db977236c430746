#include "program.h"

#include <benchmark/benchmark.h>
#include <hiprt_build/build.h>
#include <hiprt_build/embree/rtcore.h>
#include <hiprt_build/file.h>
#include <tools/render/tracers/tracer.h>

#include <iostream>
#include <span>
#include <string_view>

namespace hiprt::bench {
namespace {

constexpr int kFailure = 1, kUsage = 2;

/// The members of a run have other names in Google Benchmark 1.8 than in 1.7.
template <class Run> bool has_failed(const Run& run) {
  if constexpr (requires { run.error_occurred; })
    return run.error_occurred;
  else
    return run.skipped != decltype(run.skipped){};
}
template <class Run> const std::string& failure(const Run& run) {
  if constexpr (requires { run.error_message; })
    return run.error_message;
  else
    return run.skip_message;
}

/// One line per finished benchmark on stderr; the counters are in the JSON file and the summary.
class ProgressReporter : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context& context) override {
    PrintBasicContext(&GetErrorStream(), context);
    return true;
  }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      failed_ |= has_failed(run);
      GetErrorStream() << run.benchmark_name() << ": ";
      if (has_failed(run))
        GetErrorStream() << "FAILED: " << failure(run) << std::endl;
      else
        GetErrorStream() << run.real_accumulated_time << " s" << std::endl;
      ran_ = true;
    }
  }
  bool failed() const { return failed_; }
  bool ran() const { return ran_; }

 private:
  bool failed_ = false, ran_ = false;
};

void add_context() {
  benchmark::AddCustomContext("hiprt_version", build::version());
  benchmark::AddCustomContext("compiler", compiler_name());
  benchmark::AddCustomContext("kernels", tools::trace_isa());
  benchmark::AddCustomContext("embree_version", RTC_VERSION_STRING);
}

bool wants_help(int argc, char** argv) {
  for (const char* argument : std::span(argv, static_cast<std::size_t>(argc)))
    if (std::string_view(argument) == "--help" || std::string_view(argument) == "-h") return true;
  return false;
}

void print_help(const Program& program) {
  std::cout << program.description << "\n\nusage: " << program.name << " [FLAG...]\n"
            << describe(program.flags) << "\n";
  std::cout.flush();
  benchmark::PrintDefaultHelp();
}

int fail(const Program& program, const std::string& message, int status) {
  std::cerr << program.name << ": " << message << "\n";
  return status;
}

int finish(const Program& program, const std::string& markdown_path) {
  const Summary summary = program.summarize();
  std::cout << summary.markdown << std::flush;
  for (const std::string& fault : summary.faults) std::cerr << program.name << ": wrong result: " << fault << "\n";
  if (!markdown_path.empty()) {
    const auto written = build::write_file(markdown_path, std::as_bytes(std::span(summary.markdown)));
    if (!written) return fail(program, written.error().message, kFailure);
  }
  return summary.faults.empty() ? 0 : kFailure;
}

}  // namespace

std::string compiler_name() {
#if defined(__clang__)
  return "Clang " __clang_version__;
#elif defined(__GNUC__)
  return "GCC " __VERSION__;
#else
  return "unknown";
#endif
}

void add_benchmark(const std::string& name, std::function<void(benchmark::State&)> body) {
  benchmark::RegisterBenchmark(name.c_str(), std::move(body))->Iterations(1)->Unit(benchmark::kSecond);
}

int run_program(Program program, int argc, char** argv) {
  std::string markdown_path;
  program.flags.push_back(text_flag("markdown", "FILE", "writes the summary there too", markdown_path));
  if (wants_help(argc, argv)) {
    print_help(program);
    return 0;
  }
  if (const std::string fault = take_flags(argc, argv, program.flags); !fault.empty())
    return fail(program, fault + " (see --help)", kUsage);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return kUsage;
  add_context();
  if (const std::string fault = program.add_benchmarks(); !fault.empty()) return fail(program, fault, kUsage);
  ProgressReporter reporter;
  if (benchmark::RunSpecifiedBenchmarks(&reporter) == 0) return kFailure;
  if (!reporter.ran()) return 0;  // --benchmark_list_tests
  const int status = finish(program, markdown_path);
  return reporter.failed() ? kFailure : status;
}

}  // namespace hiprt::bench
