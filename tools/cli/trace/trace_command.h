#pragma once
/// The command line of bvhtrace.

#include <tools/cli/ranks/run_options.h>
#include <tools/render/tracers/tracer.h>

#include <hiprt_build/error.h>
#include <hiprt_build/format/view.h>

#include <cstdint>
#include <optional>
#include <string>

namespace hiprt::tools {

/// Rays of a block, if nothing else is asked for: 8 MiB of rays.
inline constexpr std::uint64_t kDefaultBlock = std::uint64_t{1} << 18;

struct TraceCommand {
  std::string path, rays, hits, paths;
  std::string query = "auto", triangle_test = "watertight", box_test = "conservative", device = "auto";
  unsigned threads = 0, repeat = 1;
  std::uint64_t max_memory = 0;  ///< Bytes that readers may take; 0: half of the machine's.
  float time = 0.0f;
  std::optional<std::uint64_t> explained;
  std::optional<std::uint64_t> block;  ///< Rays of a block; nothing: all rays at once, if that can be.
  ResumeOptions resume;
  RankFlags ranks;

  /// Whether the rays are traced in blocks.
  bool in_blocks() const { return block || !resume.file.empty(); }
  Query query_of(bool any_hit) const;
  TracePolicies policies() const;
};

/// Adds every option of bvhtrace, and the checks of options that exclude or need each other.
void add_trace_options(CLI::App& app, TraceCommand& command);

/// Checks that the outputs can be written and are neither inputs nor the same file.
build::Result<void> check_outputs(const TraceCommand& command);

/// Scenes with shapes have no tracers for the less accurate tests. @return kInvalidInput if one is asked for.
build::Result<void> check_policies(const TraceCommand& command, const FileHeader& header);

}  // namespace hiprt::tools
