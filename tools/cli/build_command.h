#pragma once
/// What the command line of bvhbuild says.

#include <tools/cli/names.h>

#include <hiprt_build/instances.h>

#include <CLI/CLI.hpp>

#include <optional>
#include <string>
#include <vector>

namespace hiprt::tools {

inline constexpr Names<build::InstanceBounds, 4> kInstanceBounds{
    {{"root", build::InstanceBounds::kRoot},
     {"children", build::InstanceBounds::kChildren},
     {"grandchildren", build::InstanceBounds::kGrandchildren},
     {"primitives", build::InstanceBounds::kPrimitives}}};

struct BuildCommand {
  std::vector<std::string> inputs, moved;
  std::string output;
  std::string builder = build::name(build::BuildOptions{}.builder), quality, nodes = "auto", target = "cpu",
              device = "cpu";
  unsigned ploc_radius = build::BuildOptions{}.ploc_radius;
  std::optional<unsigned> rounds;
  unsigned threads = 0, max_leaf = build::BuildOptions{}.max_leaf_triangles;
  double presplit_budget = build::BuildOptions{}.presplit_budget;
  std::optional<double> split_budget;
  bool no_pairs = false, stats = false, builder_given = false;
  std::string imported;  ///< Empty: none.
  bool instances = false, flatten = false;
  std::string instance_bounds = "grandchildren";
  double opening_budget = build::InstanceOptions{}.opening_budget;
  unsigned levels = 0;  ///< That may be left of a scene's; 0: all.
  std::string shutter;  ///< Empty: animations are not read.
  unsigned motion_keys = 2;

  /// Is the input a scene of instances, or to become one?
  bool is_scene() const;
  /// The times at which to look at animations; none without --shutter.
  std::vector<float> motion_times() const;
};

/// Adds every option of bvhbuild, and what goes with what.
void add_build_options(CLI::App& app, BuildCommand& command);

/// @param tool for the provenance; has to live as long as the options.
build::BuildOptions build_options(const BuildCommand& command, std::string_view tool, build::ProgressCallback progress);

/// A description of a scene by its name: .json, or the binary .scene. In any case of the letters.
bool is_scene_file(const std::string& path);
bool is_scene_json(const std::string& path);

}  // namespace hiprt::tools
