#include <tools/query/query_block.h>

#include <tools/base/interrupt.h>
#include <tools/cli/trace/trace_records.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace hiprt::tools {
namespace {

PointQuery point_query(const QueryWork& work, std::size_t i) {
  const float* const at = work.batch.at(i);
  return {.point = {at[0], at[1], at[2]},
          .max_distance = work.batch.shape == QueryShape::kSphere ? at[3] : work.max_distance,
          .time = work.time};
}

std::vector<PointQuery> point_queries(const QueryWork& work, std::size_t begin, std::size_t count) {
  std::vector<PointQuery> queries(count);
  for (std::size_t i = 0; i < count; ++i) queries[i] = point_query(work, begin + i);
  return queries;
}

Box box_query(const QueryWork& work, std::size_t i) {
  const float* const at = work.batch.at(i);
  Box box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.min[axis] = at[axis];
    box.max[axis] = at[axis + 3];
  }
  return box;
}

}  // namespace

bool QueryBlock::take(std::size_t query, const ClosestPoint& point, const std::uint32_t* path) {
  found_.push_back({static_cast<std::uint32_t>(query), point});
  // Overlaps are in the order of their numbers.
  if (kind_ == QueryKind::kOverlaps) found_.back().point.distance_squared = 0.0;
  paths_.insert(paths_.end(), path, path + levels_);
  return !interrupted_at(found_.size());
}

bool QueryBlock::run_points(const QueryWork& work, std::size_t begin) {
  const std::vector<PointQuery> queries = point_queries(work, begin, count_);
  const std::uint32_t nearest = has_lists(kind_) ? 0 : kind_ == QueryKind::kNearest ? work.nearest : 1;
  std::vector<std::max_align_t> scratch(nearest * kPathPointBytes / sizeof(std::max_align_t) + 1);
  const auto take_point = [](void* to, std::size_t query, const ClosestPoint& point, const std::uint32_t* path) {
    return static_cast<QueryBlock*>(to)->take(query, point, path);
  };
  return find(PointJob{&work.scene, queries.data(), count_, nearest, scratch.data(), {take_point, this}});
}

bool QueryBlock::run_sides(const QueryWork& work, std::size_t begin) {
  const std::vector<PointQuery> queries = point_queries(work, begin, count_);
  inside_.resize(count_);
  return find(SideJob{&work.scene, queries.data(), count_, inside_.data(), work.winding});
}

bool QueryBlock::run_boxes(const QueryWork& work, std::size_t begin) {
  struct Taker {
    QueryBlock& block;
    std::size_t query;
    bool is_any;
  };
  const auto take_overlap = [](void* to, std::size_t, const FoundOverlap& overlap, const std::uint32_t* path) {
    const auto& taker = *static_cast<const Taker*>(to);
    ClosestPoint point;
    point.geometry = overlap.geometry;
    point.primitive = overlap.primitive;
    return taker.block.take(taker.query, point, path) && !taker.is_any;
  };
  for (std::size_t i = 0; i < count_; ++i) {
    const Box box = box_query(work, begin + i);
    Taker taker{*this, i, kind_ == QueryKind::kAnyOverlap};
    if (!find(OverlapJob{&work.scene, &box, 1, work.time, {take_overlap, &taker}})) return false;
  }
  return true;
}

bool QueryBlock::run(const QueryWork& work, std::size_t begin, std::size_t end) {
  kind_ = work.kind;
  count_ = end - begin;
  levels_ = work.scene.levels;
  bool good = true;
  if (work.batch.shape == QueryShape::kBox)
    good = run_boxes(work, begin);
  else if (kind_ != QueryKind::kInside)
    good = run_points(work, begin);
  if (good && (kind_ == QueryKind::kSigned || kind_ == QueryKind::kInside)) good = run_sides(work, begin);
  failed_ = !good;
  if (!good || interrupted()) return false;
  sort();
  return true;
}

/// In the order of queries, distance, path, geometry and primitive.
bool QueryBlock::precedes(std::size_t a, std::size_t b) const {
  const Found &left = found_[a], &right = found_[b];
  if (left.query != right.query) return left.query < right.query;
  if (left.point.distance_squared != right.point.distance_squared)
    return left.point.distance_squared < right.point.distance_squared;
  const auto path = [&](std::size_t i) { return std::span(paths_).subspan(i * levels_, levels_); };
  const auto [in_left, in_right] = std::ranges::mismatch(path(a), path(b));
  if (in_left != path(a).end()) return *in_left < *in_right;
  if (left.point.geometry != right.point.geometry) return left.point.geometry < right.point.geometry;
  return left.point.primitive < right.point.primitive;
}

/// Lists may have a triangle that a builder has split several times: then once is enough.
void QueryBlock::sort() {
  order_.resize(found_.size());
  for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = i;
  const auto before = [this](std::size_t a, std::size_t b) { return precedes(a, b); };
  std::ranges::sort(order_, before);
  const auto same = [&](std::size_t a, std::size_t b) { return !before(a, b); };
  order_.erase(std::unique(order_.begin(), order_.end(), same), order_.end());
}

void QueryBlock::append_record(QueryResults& results, const SceneView& scene, const Found* found,
                               const std::uint32_t* path) const {
  std::uint32_t number = kInvalidId;
  if (found != nullptr)
    number = primitive_number(scene, {path, levels_}, found->point.geometry, found->point.primitive);
  if (!has_points(kind_)) {
    results.numbers.push_back(number);
  } else if (found == nullptr) {
    results.points.push_back({std::numeric_limits<float>::infinity(), 0, 0, 0, 0, 0, number, 0});
  } else {
    const ClosestPoint& p = found->point;
    results.points.push_back(
        {p.distance(), p.point.x, p.point.y, p.point.z, p.u, p.v, number, static_cast<std::uint32_t>(p.feature)});
  }
  for (std::size_t k = 0; k < levels_; ++k) results.paths.push_back(path != nullptr ? path[k] : kInvalidId);
}

void QueryBlock::append_to(QueryResults& results, const SceneView& scene) const {
  if (kind_ == QueryKind::kInside) {
    results.numbers.insert(results.numbers.end(), inside_.begin(), inside_.end());
    results.found += static_cast<std::size_t>(std::ranges::count(inside_, 1u));
    return;
  }
  std::size_t next = 0;
  for (std::uint32_t query = 0; query < count_; ++query) {
    if (results.each == 0) results.first.push_back(results.records());
    const std::size_t before = next;
    for (; next < order_.size() && found_[order_[next]].query == query; ++next)
      append_record(results, scene, &found_[order_[next]], paths_.data() + order_[next] * levels_);
    results.found += next != before ? 1 : 0;
    for (std::size_t k = next - before; k < results.each; ++k) append_record(results, scene, nullptr, nullptr);
    if (kind_ == QueryKind::kSigned && inside_[query] == 1)
      results.points.back().distance = -results.points.back().distance;
  }
}

}  // namespace hiprt::tools
