#pragma once
/// The results of a block of queries, sorted, each once.

#include <hiprt_build/python/arrays.h>
#include <hiprt_build/python/tracers/job.h>
#include <hiprt_build/python/watch.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>
#include <vector>

namespace hiprt::python {

/// @tparam kDistance the member of Record by which results are ordered first; nullptr: there is none.
template <class Record, auto kDistance> struct BlockList {
  struct Entry {
    Record record;
    std::uint32_t path;  ///< Number in paths.
  };

  explicit BlockList(std::size_t path_length) : levels(path_length) {}

  const std::uint32_t* path_of(const Entry& entry) const { return paths.data() + entry.path * levels; }

  /// By distance, path, geometry and primitive, as next_hit() and next_point() order results.
  bool before(const Entry& a, const Entry& b) const {
    if constexpr (!std::is_null_pointer_v<decltype(kDistance)>)
      if (a.record.*kDistance != b.record.*kDistance) return a.record.*kDistance < b.record.*kDistance;
    const auto *path_a = path_of(a), *path_b = path_of(b);
    // No path begins another one: what an instance refers to is either an object or a group.
    if (!std::equal(path_a, path_a + levels, path_b))
      return std::lexicographical_compare(path_a, path_a + levels, path_b, path_b + levels);
    return std::tie(a.record.geometry, a.record.primitive) < std::tie(b.record.geometry, b.record.primitive);
  }

  /// Sorts the results of the last query, leaves one of each, and the first @p most.
  void end_query(std::size_t most) {
    const std::size_t begin = ends.empty() ? 0 : ends.back();
    const auto first = entries.begin() + static_cast<std::ptrdiff_t>(begin);
    std::sort(first, entries.end(), [this](const Entry& a, const Entry& b) { return before(a, b); });
    entries.erase(std::unique(first, entries.end(), [this](const Entry& a, const Entry& b) { return !before(a, b); }),
                  entries.end());
    if (entries.size() - begin > most) entries.resize(begin + most);
    ends.push_back(entries.size());
  }

  /// Writes the number of results of each query.
  void count_to(std::uint32_t* to) const {
    std::size_t begin = 0;
    for (std::size_t i = 0; i < ends.size(); begin = ends[i++]) to[i] = static_cast<std::uint32_t>(ends[i] - begin);
  }

  std::size_t levels;
  std::vector<Entry> entries;
  std::vector<std::uint32_t> paths;
  std::vector<std::size_t> ends;  ///< Of the queries, in entries.
};

/// Puts what a tracer finds into a list.
template <class Record, auto kDistance> struct Collector {
  BlockList<Record, kDistance>& list;
  const Watch& watch;
  std::size_t most = ~std::size_t{0};  ///< Results of one query.

  Sink<Record> sink() { return {&Collector::take, this}; }
  /// Ends the queries up to @p count.
  void finish(std::size_t count) {
    while (list.ends.size() < count) list.end_query(most);
  }

 private:
  static bool take(void* to, std::size_t query, const Record& record, const std::uint32_t* path) {
    auto& self = *static_cast<Collector*>(to);
    self.finish(query);
    const std::size_t known = self.list.levels == 0 ? 0 : self.list.paths.size() / self.list.levels;
    self.list.entries.push_back({record, static_cast<std::uint32_t>(known)});
    self.list.paths.insert(self.list.paths.end(), path, path + self.list.levels);
    return !self.watch.stopped();
  }
};

/// Counts results where none comes twice.
template <class Record> struct Counter {
  std::uint32_t* counts;
  const Watch& watch;

  Sink<Record> sink() { return {&Counter::take, this}; }

 private:
  static bool take(void* to, std::size_t query, const Record&, const std::uint32_t*) {
    auto& self = *static_cast<Counter*>(to);
    ++self.counts[query];
    return !self.watch.stopped();
  }
};

/// Arrays that all lists of results have.
struct ListArrays {
  ListArrays(std::size_t queries, std::size_t total, std::size_t levels)
      : offsets(queries + 1), geometry(total), primitive(total), paths(total * levels) {}

  NewArray<std::int64_t> offsets;
  NewArray<std::uint32_t> geometry, primitive, paths;
};

/// The number of results in lists.
template <class List> std::size_t total_of(const std::vector<List>& blocks) {
  std::size_t total = 0;
  for (const List& block : blocks) total += block.entries.size();
  return total;
}

/// Fills the arrays from the lists of consecutive blocks. @param put receives the number of a result and its record.
template <class List, class Put> void join(const std::vector<List>& blocks, ListArrays& to, const Put& put) {
  std::size_t query = 0, at = 0;
  to.offsets.data()[0] = 0;
  for (const List& block : blocks) {
    for (const std::size_t end : block.ends) to.offsets.data()[++query] = static_cast<std::int64_t>(at + end);
    for (const auto& entry : block.entries) {
      to.geometry.data()[at] = entry.record.geometry;
      to.primitive.data()[at] = entry.record.primitive;
      std::copy_n(block.path_of(entry), block.levels, to.paths.data() + at * block.levels);
      put(at++, entry.record);
    }
  }
}

/// Whether a scene's leaves may repeat results: those of opened instances and of split triangles do.
inline bool may_repeat(const SceneView& scene) {
  return scene.levels != 0 || (scene.features & feature_bit(Feature::kSplitReferences)) != 0;
}

}  // namespace hiprt::python
