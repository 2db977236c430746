#pragma once
/// What the queries of one task have found.

#include <tools/query/query_run.h>
#include <tools/render/tracers/point_tracer.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace hiprt::tools {

/// Collects results of queries [begin, end) of a batch in any order, and turns them into records.
class QueryBlock {
 public:
  QueryBlock() = default;

  /// @return false if interrupted() or a stack was too small: see failed().
  bool run(const QueryWork& work, std::size_t begin, std::size_t end);
  bool failed() const { return failed_; }

  /// Appends the records of this block to those of the blocks before it.
  void append_to(QueryResults& results, const SceneView& scene) const;

 private:
  /// `point` has geometry and primitive only for an overlap.
  struct Found {
    std::uint32_t query;  ///< Within the block.
    ClosestPoint point;
  };

  bool run_points(const QueryWork& work, std::size_t begin);
  bool run_sides(const QueryWork& work, std::size_t begin);
  bool run_boxes(const QueryWork& work, std::size_t begin);
  bool take(std::size_t query, const ClosestPoint& point, const std::uint32_t* path);
  bool precedes(std::size_t a, std::size_t b) const;
  void sort();
  void append_record(QueryResults& results, const SceneView& scene, const Found* found,
                     const std::uint32_t* path) const;

  QueryKind kind_ = QueryKind::kClosest;
  std::size_t count_ = 0, levels_ = 0;
  std::vector<Found> found_;
  std::vector<std::uint32_t> paths_;   ///< levels_ per result.
  std::vector<std::size_t> order_;     ///< Of the results.
  std::vector<std::uint32_t> inside_;  ///< Of kSigned and kInside: 1 or 0 per query.
  bool failed_ = false;
};

}  // namespace hiprt::tools
