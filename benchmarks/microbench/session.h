#pragma once
/// Runs variants over trees and rays, and checks what they answer.

#include "engine.h"

#include <functional>
#include <string>
#include <vector>

namespace hiprt::bench {

struct SessionOptions {
  std::vector<std::vector<std::string>> values;  ///< Per axis of kAxes: wanted values; empty: all.
  std::vector<std::filesystem::path> trees;
  std::vector<std::filesystem::path> ray_files;  ///< Of all scenes. Empty: those beside the trees.
  std::vector<std::string> kinds;                ///< Empty: all.
  std::filesystem::path camera_file;             ///< For scenes without ray files.
  Picture picture;
  Repetitions repetitions;
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
  std::uint64_t overflowed = 0;  ///< Rays whose stack was too small: not in the checks.
  std::uint64_t checked = 0;     ///< Rays compared with the host's answers, and how many differ: see
  std::uint64_t wrong = 0;       ///< HostAnswers::Comparison.
  std::uint64_t other_primitives = 0;
  std::string problem;  ///< Why it could not be measured.
};

struct Report {
  std::vector<TreeRecord> trees;
  std::vector<Result> results;
  std::vector<std::string> faults;  ///< Wrong results of exact variants (is_exact()), and what could not be measured.
};

/// Whether the variant has the wanted values.
bool is_wanted(const VariantName& name, const std::vector<std::vector<std::string>>& values);

/// @param progress receives a line for each tree and kind of rays.
/// @return kIo or kInvalidInput if a file cannot be used.
build::Result<Report> run_session(Engine& engine, const SessionOptions& options,
                                  const std::function<void(const std::string&)>& progress);

}  // namespace hiprt::bench
