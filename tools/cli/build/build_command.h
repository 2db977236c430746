#pragma once
/// The command line of bvhbuild.

#include <tools/build/build_request.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}  // namespace CLI

namespace hiprt::tools {

struct BuildCommand {
  std::vector<std::string> inputs, moved;
  std::string output;
  std::string builder = build::name(build::BuildOptions{}.builder), quality, nodes = "auto", target = "cpu",
              device = "cpu";
  unsigned ploc_radius = build::BuildOptions{}.ploc_radius;
  std::optional<unsigned> rounds;
  std::uint64_t max_memory = 0;  ///< Bytes that readers may take; 0: half of the machine's.
  unsigned threads = 0, max_leaf = build::BuildOptions{}.max_leaf_triangles;
  double presplit_budget = build::BuildOptions{}.presplit_budget;
  std::optional<double> split_budget;
  bool no_pairs = false, stats = false;
  std::string imported;  ///< Empty: none.
  bool instances = false, flatten = false;
  std::string instance_bounds = "grandchildren";
  double opening_budget = build::InstanceOptions{}.opening_budget;
  bool open_largest = build::InstanceOptions{}.open_largest;
  unsigned levels = 0;  ///< Levels of instances to keep; 0: all.
  unsigned parts = 0;   ///< Files to distribute the instances to; 0: one file without a manifest.
  std::string shutter;  ///< Empty: animations are not read.
  unsigned motion_keys = 2;
  std::string cache;     ///< Folder of built files; empty: none.
  std::string manifest;  ///< Many assets to build into the cache; empty: none.
  std::string prune;     ///< Which entries of the cache to remove; empty: none.
  bool lossy_ranks = false;

  /// Whether the input is a scene of instances or becomes one (--instances).
  bool is_scene() const;
  /// The times at which animations are sampled; none without --shutter.
  std::vector<float> motion_times() const;
};

/// Adds every option of bvhbuild, and the checks of options that exclude or need each other.
void add_build_options(CLI::App& app, BuildCommand& command);

/// @param tool for the provenance record of the file. It must outlive the result.
BuildRequest make_request(const BuildCommand& command, std::string_view tool);

}  // namespace hiprt::tools
