#include <tools/query/write_results.h>

#include <tools/base/errors.h>
#include <tools/cli/trace/trace_records.h>
#include <tools/scene_io/npy_file.h>
#include <tools/scene_io/query_npy.h>
#include <tools/scene_io/rays_file.h>

#include <span>
#include <string>
#include <vector>

namespace hiprt::tools {
namespace {

std::span<const std::byte> records_of(const QueryResults& results) {
  return results.points.empty() ? std::as_bytes(std::span{results.numbers}) : std::as_bytes(std::span{results.points});
}

build::Result<void> write_npy(const QueryCommand& command, const QueryResults& results, std::size_t queries) {
  const NpyRecord record = has_points(command.kind()) ? NpyRecord::kPoint : NpyRecord::kNumber;
  if (results.each == 0) return write_npy_lists(command.output, record, results.first, records_of(results));
  std::vector<std::uint64_t> shape{queries};
  if (command.kind() == QueryKind::kNearest) shape.push_back(results.each);
  return write_npy_results(command.output, record, shape, records_of(results));
}

build::Result<void> write_raw(const QueryCommand& command, const QueryResults& results, std::size_t queries) {
  return results.each == 0
             ? write_lists(command.output, results.first, records_of(results))
             : write_results(command.output, static_cast<std::uint32_t>(queries), results.each, records_of(results));
}

}  // namespace

build::Result<void> write_all(const QueryCommand& command, const SceneView& scene, const QueryResults& results,
                              std::size_t queries) {
  const bool npy_paths = is_npy_name(command.paths);
  if (!command.paths.empty() && !npy_paths && results.records() > 0xffffffffu)
    return fail(build::ErrorCode::kTooLarge, command.paths + ": " + std::to_string(results.records()) +
                                                 " results, a path file holds at most 4294967295");
  auto written =
      is_npy_name(command.output) ? write_npy(command, results, queries) : write_raw(command, results, queries);
  if (!written || command.paths.empty()) return written;
  const auto paths = path_records(scene, results.paths);
  return npy_paths ? write_npy_paths(command.paths, results.records(), scene.levels, std::as_bytes(std::span{paths}))
                   : write_paths(command.paths, static_cast<std::uint32_t>(results.records()), scene.levels, paths);
}

}  // namespace hiprt::tools
