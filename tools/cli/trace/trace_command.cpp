#include <tools/cli/trace/trace_command.h>

#include <tools/base/output_file.h>
#include <tools/cli/cli.h>
#include <tools/cli/trace/trace_names.h>
#include <tools/cli/trace_device.h>

#include <CLI/CLI.hpp>

#include <array>
#include <filesystem>

namespace hiprt::tools {
namespace {

void add_file_options(CLI::App& app, TraceCommand& command) {
  app.add_option("FILE", command.path, "BVH file to trace")->required()->type_name("")->group(kInputGroup);
  app.add_option("--rays", command.rays, "Rays to trace")->required()->type_name("FILE")->group(kInputGroup);
  app.add_option("--hits", command.hits, "File of hits to write")->type_name("FILE")->group(kOutputGroup);
  app.add_option("--paths", command.paths, "File of paths to write: the instances that lead to each hit")
      ->type_name("FILE")
      ->group(kOutputGroup);
  app.add_option("--explain", command.explained, "Print the traversal of this ray. Write nothing")
      ->excludes("--hits")
      ->excludes("--paths")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N")
      ->group(kOutputGroup);
}

void add_tracing_options(CLI::App& app, TraceCommand& command) {
  constexpr const char* kGroup = "Tracing";
  app.add_option("--query", command.query, "Kind of query. auto: as the any-hit flag of the ray file says")
      ->check(CLI::IsMember(words(kQueries, {"auto"})))
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--triangle-test", command.triangle_test,
                 "Triangle test. fast may miss at edges and corners, reference decides exactly")
      ->check(CLI::IsMember(words(kTriangleTests)))
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--box-test", command.box_test, "Box test. plain may miss boxes that a ray grazes")
      ->check(CLI::IsMember(words(kBoxTests)))
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--time", command.time, "Time of all rays, for scenes that move")
      ->type_name("T")
      ->capture_default_str()
      ->group(kGroup);
  add_device_option(app, command.device);
  add_threads_option(app, command.threads);
  add_memory_option(app, command.max_memory);
  app.add_option("--repeat", command.repeat, "Trace N times and report the median speed")
      ->check(CLI::Range(1u, 1000000u))
      ->type_name("N")
      ->capture_default_str()
      ->group(kMachineGroup);
  app.get_option("--explain")->excludes("--repeat");
}

void add_block_options(CLI::App& app, TraceCommand& command) {
  app.add_option(
         "--block", command.block,
         "Trace N rays at a time, so that the files may be larger than memory. Default: all rays at once; under "
         "mpirun and with --resume " +
             std::to_string(kDefaultBlock))
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 30))
      ->type_name("N")
      ->group("Long runs");
  add_resume_options(app, command.resume,
                     "Keep in this file which blocks are traced, and go on from them if it exists. The hits are in "
                     "HITS.part until all are there");
  add_rank_options(app, command.ranks);
}

/// Checks that involve several options.
void check_options(const TraceCommand& command) {
  if (command.in_blocks() && (command.repeat != 1 || command.explained))
    throw CLI::ValidationError("--block and --resume go neither with --repeat nor with --explain");
  if (command.hits.empty() && !command.explained) throw CLI::RequiredError("--hits (or --explain)");
  if (command.explained && value_of(kDeviceChoices, command.device) == DeviceChoice::kGpu)
    throw CLI::ValidationError("--explain traces the ray on the CPU: use --device auto or cpu");
  if (value_of(kTriangleTests, command.triangle_test) == TriangleTestKind::kReference &&
      value_of(kBoxTests, command.box_test) != BoxTestKind::kConservative)
    throw CLI::ValidationError(
        "--triangle-test reference is with --box-test conservative: with plain boxes hits would be lost");
}

}  // namespace

Query TraceCommand::query_of(bool any_hit) const {
  return (query == "auto" ? any_hit : query == "any") ? Query::kAny : Query::kClosest;
}

TracePolicies TraceCommand::policies() const {
  return {value_of(kTriangleTests, triangle_test), value_of(kBoxTests, box_test)};
}

void add_trace_options(CLI::App& app, TraceCommand& command) {
  add_file_options(app, command);
  add_tracing_options(app, command);
  add_block_options(app, command);
  app.callback([&command] { check_options(command); });
}

/// Checks that the outputs can be written and are neither inputs nor the same file.
build::Result<void> check_outputs(const TraceCommand& command) {
  const std::array inputs{command.path, command.rays};
  if (auto checked = check_output(command.hits, inputs); !checked) return checked;
  if (!command.resume.file.empty()) {
    const std::array others{command.path, command.rays, command.hits, command.paths};
    if (auto checked = check_output(command.resume.file, others); !checked) return checked;
  }
  if (command.paths.empty()) return {};
  std::error_code ignored;
  if (std::filesystem::weakly_canonical(command.paths, ignored) ==
      std::filesystem::weakly_canonical(command.hits, ignored))
    return tl::unexpected(
        build::Error{build::ErrorCode::kInvalidInput, command.paths + ": --hits and --paths are one file"});
  return check_output(command.paths, inputs);
}

/// Scenes with shapes have no tracers for the less accurate tests.
build::Result<void> check_policies(const TraceCommand& command, const FileHeader& header) {
  const TracePolicies policies = command.policies();
  if ((header.features & feature_bit(Feature::kCustom)) == 0 ||
      (policies.triangle_test != TriangleTestKind::kFast && policies.box_test == BoxTestKind::kConservative))
    return {};
  return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput,
                                     command.path +
                                         ": has spheres or curves, which are traced with --triangle-test watertight or "
                                         "reference and --box-test conservative only"});
}

}  // namespace hiprt::tools
