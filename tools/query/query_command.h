#pragma once
/// The command line of bvhquery.

#include <tools/query/query_run.h>
#include <tools/query/slice.h>

#include <cstdint>
#include <limits>
#include <string>

namespace CLI {
class App;
}  // namespace CLI

namespace hiprt::tools {

struct QueryCommand {
  std::string path, points, spheres, boxes, output, paths;
  std::string query = "auto", sign = "crossings";
  std::uint32_t nearest = 8;
  float max_distance = std::numeric_limits<float>::infinity();
  float time = 0.0f;
  std::string slice, size = "768x768";
  unsigned threads = 0;
  std::uint64_t max_memory = 0;  ///< Bytes that readers may take; 0: half of the machine's.

  bool is_slice() const { return !slice.empty(); }
  QueryShape shape() const;
  /// The file of points, spheres or boxes.
  const std::string& input() const;
  QueryKind kind() const;
  /// Whether winding numbers decide on the side of points.
  bool uses_winding() const;
};

/// Adds every option of bvhquery.
void add_query_options(CLI::App& app, QueryCommand& command);

/// Checks that involve several options. Throws CLI's errors.
void check_query_command(const CLI::App& app, const QueryCommand& command);

}  // namespace hiprt::tools
