#pragma once
/// Runs variants over trees and rays and checks their results.

#include "engine.h"
#include "vulkan_peers.h"

#include <functional>
#include <string>
#include <vector>

namespace hiprt::bench {

struct SessionOptions {
  std::vector<std::vector<std::string>> values;  ///< Wanted values per axis of kAxes; empty: all.
  std::vector<std::filesystem::path> trees;
  std::vector<std::filesystem::path> ray_files;  ///< For all scenes. Empty: the files beside the trees.
  std::vector<std::string> kinds;                ///< Empty: all.
  std::filesystem::path camera_file;             ///< For scenes without ray files.
  Picture picture;
  Repetitions repetitions;
  VulkanPeers* vulkan = nullptr;  ///< nullptr: not measured.
};

/// A tree without its bytes.
struct TreeRecord {
  std::string scene, name, path, layout;
  std::uint64_t bytes, primitives, nodes, leaves;
  std::uint32_t stack_bound;
  FeatureMask features;
  std::string provenance;  ///< JSON of the file; may be empty.
};

/// One variant, tree and kind of rays.
struct Result {
  std::size_t tree;     ///< Index into Report::trees.
  std::size_t variant;  ///< Of the engine.
  std::string kind, ray_order;
  std::size_t rays = 0;
  double min_ms = 0, median_ms = 0, max_ms = 0, mrays_s = 0;
  unsigned repetitions = 0;
  std::uint64_t checksum = 0;
  std::uint64_t hits = 0;
  std::uint64_t overflowed = 0;  ///< Rays whose stack was too small. They are not checked.
  std::uint64_t checked = 0;     ///< Rays compared with the host, and how many differ (HostResults::Comparison).
  std::uint64_t wrong = 0;
  std::uint64_t other_primitives = 0;
  std::string problem;  ///< Reason why the variant could not be measured.
};

struct Report {
  std::vector<TreeRecord> trees;
  std::vector<Result> results;
  std::vector<std::string> faults;  ///< Wrong results of exact variants (is_exact()), and failed measurements.
};

/// Whether the variant has the wanted values.
bool is_wanted(const VariantName& name, const std::vector<std::vector<std::string>>& values);

/// @param progress receives a line for each tree and kind of rays.
/// @return kIo or kInvalidInput if a file cannot be read.
build::Result<Report> run_session(Engine& engine, const SessionOptions& options,
                                  const std::function<void(const std::string&)>& progress);

}  // namespace hiprt::bench
