#include <hiprt_build/python/arrays.h>
#include <hiprt_build/python/errors.h>
#include <hiprt_build/python/queries.h>
#include <hiprt_build/python/tracers/tracers.h>

#include <nanobind/stl/string.h>

#include <algorithm>
#include <tuple>
#include <vector>

namespace hiprt::python {
namespace {

namespace nb = nanobind;

/// The hits of a block of rays, ray by ray.
struct BlockHits {
  struct Entry {
    ListedHit hit;
    std::uint32_t path;  ///< Number in paths.
  };

  explicit BlockHits(std::size_t path_length) : levels(path_length) {}

  const std::uint32_t* path_of(const Entry& entry) const { return paths.data() + entry.path * levels; }

  /// By t, path, geometry and primitive, as ClosestHit::next_hit() orders hits.
  bool before(const Entry& a, const Entry& b) const {
    if (a.hit.t != b.hit.t) return a.hit.t < b.hit.t;
    const auto *path_a = path_of(a), *path_b = path_of(b);
    // No path begins another one: what an instance refers to is either an object or a group.
    if (!std::equal(path_a, path_a + levels, path_b))
      return std::lexicographical_compare(path_a, path_a + levels, path_b, path_b + levels);
    return std::tie(a.hit.geometry, a.hit.primitive) < std::tie(b.hit.geometry, b.hit.primitive);
  }

  /// Sorts the hits of the last ray, leaves one of each, and the first @p most.
  void end_ray(std::size_t most) {
    const auto first = entries.begin() + static_cast<std::ptrdiff_t>(ends.empty() ? 0 : ends.back());
    std::sort(first, entries.end(), [this](const Entry& a, const Entry& b) { return before(a, b); });
    entries.erase(std::unique(first, entries.end(), [this](const Entry& a, const Entry& b) { return !before(a, b); }),
                  entries.end());
    const std::size_t begin = ends.empty() ? 0 : ends.back();
    if (entries.size() - begin > most) entries.resize(begin + most);
    ends.push_back(entries.size());
  }

  std::size_t levels;
  std::vector<Entry> entries;
  std::vector<std::uint32_t> paths;
  std::vector<std::size_t> ends;  ///< Of the rays, in entries.
};

/// What the tracer calls.
struct Collector {
  BlockHits& hits;
  const Watch& watch;
  std::size_t most;

  static bool take(void* to, std::size_t ray, const ListedHit& hit, const std::uint32_t* path) {
    auto& self = *static_cast<Collector*>(to);
    while (self.hits.ends.size() < ray) self.hits.end_ray(self.most);
    const std::size_t known = self.hits.levels == 0 ? 0 : self.hits.paths.size() / self.hits.levels;
    self.hits.entries.push_back({hit, static_cast<std::uint32_t>(known)});
    self.hits.paths.insert(self.hits.paths.end(), path, path + self.hits.levels);
    return !self.watch.stopped();
  }
};

template <class Real>
void collect(const SceneView& scene, const Rays& rays, Precision precision, std::size_t most, const Watch& watch,
             std::size_t first, std::size_t count, BlockHits& hits) {
  BasicRay<Real> block[kBlock];
  rays.gather(first, count, block);
  Collector collector{hits, watch, most};
  trace({&scene, Query::kAll, precision, block, nullptr, nullptr, count, {&Collector::take, &collector}});
  while (hits.ends.size() < count) hits.end_ray(most);
}

BlockHits collected(const SceneView& scene, const Rays& rays, Precision precision, std::size_t most, const Watch& watch,
                    std::size_t first, std::size_t count) {
  BlockHits hits(scene.levels);
  precision == Precision::kDouble ? collect<double>(scene, rays, precision, most, watch, first, count, hits)
                                  : collect<float>(scene, rays, precision, most, watch, first, count, hits);
  return hits;
}

/// Calls body(scene, watch, first, count) for every block of rays.
template <class Body>
void for_all_hits(const SceneData& data, const Rays& rays, unsigned threads, const nb::object& progress,
                  const Body& body) {
  Watch watch(rays.size());
  // All hits of a few rays may be many.
  constexpr std::size_t kFew = 16;
  run_watched(progress, watch, rays.size() <= kFew, [&] {
    const SceneView scene = make_scene_view(data.view());
    check_traceable(scene);
    for_blocks(rays.size(), threads, watch,
               [&](std::size_t first, std::size_t count) { body(scene, watch, first, count); });
  });
}

/// Counts hits of scenes in which no primitive lies in two leaves.
struct Counter {
  std::uint32_t* counts;
  const Watch& watch;

  static bool take(void* to, std::size_t ray, const ListedHit&, const std::uint32_t*) {
    auto& self = *static_cast<Counter*>(to);
    ++self.counts[ray];
    return !self.watch.stopped();
  }
};

template <class Real>
void count_block(const SceneView& scene, const Rays& rays, Precision precision, const Watch& watch, std::size_t first,
                 std::size_t count, std::uint32_t* counts) {
  BasicRay<Real> block[kBlock];
  rays.gather(first, count, block);
  std::fill_n(counts, count, 0u);
  Counter counter{counts, watch};
  trace({&scene, Query::kAll, precision, block, nullptr, nullptr, count, {&Counter::take, &counter}});
}

/// The leaves of opened instances and of split triangles repeat hits.
bool may_repeat(const SceneView& scene) {
  return scene.levels != 0 || (scene.features & feature_bit(Feature::kSplitReferences)) != 0;
}

void count(const Scene& scene, const Rays& rays, const std::string& word, unsigned threads, const nb::object& progress,
           const OutputArray& result) {
  const auto data = scene.data();
  const Precision precision = precision_of(word);
  std::uint32_t* const to = data_of<std::uint32_t>(result, "count", rays.size());
  const auto count_plainly = [&](const SceneView& view, const Watch& watch, std::size_t first, std::size_t number) {
    precision == Precision::kDouble ? count_block<double>(view, rays, precision, watch, first, number, to + first)
                                    : count_block<float>(view, rays, precision, watch, first, number, to + first);
  };
  for_all_hits(*data, rays, threads, progress,
               [&](const SceneView& view, const Watch& watch, std::size_t first, std::size_t number) {
                 if (!may_repeat(view)) return count_plainly(view, watch, first, number);
                 const BlockHits hits = collected(view, rays, precision, ~std::size_t{0}, watch, first, number);
                 std::size_t begin = 0;
                 for (std::size_t i = 0; i < number; begin = hits.ends[i++])
                   to[first + i] = static_cast<std::uint32_t>(hits.ends[i] - begin);
               });
}

/// The arrays of a list.
template <class Real> nb::tuple joined(const std::vector<BlockHits>& blocks, std::size_t rays, std::size_t levels) {
  std::size_t total = 0;
  for (const BlockHits& block : blocks) total += block.entries.size();
  NewArray<std::int64_t> offsets(rays + 1);
  NewArray<Real> t(total), u(total), v(total);
  NewArray<std::uint32_t> geometry(total), primitive(total), paths(total * levels);
  {
    const nb::gil_scoped_release without_gil;
    std::size_t ray = 0, to = 0;
    offsets.data()[0] = 0;
    for (const BlockHits& block : blocks) {
      for (const std::size_t end : block.ends) offsets.data()[++ray] = static_cast<std::int64_t>(to + end);
      for (const BlockHits::Entry& entry : block.entries) {
        t.data()[to] = static_cast<Real>(entry.hit.t);
        u.data()[to] = static_cast<Real>(entry.hit.u);
        v.data()[to] = static_cast<Real>(entry.hit.v);
        geometry.data()[to] = entry.hit.geometry;
        primitive.data()[to] = entry.hit.primitive;
        std::copy_n(block.path_of(entry), levels, paths.data() + to++ * levels);
      }
    }
  }
  return nb::make_tuple(offsets.release({rays + 1}), t.release({total}), u.release({total}), v.release({total}),
                        geometry.release({total}), primitive.release({total}), paths.release({total, levels}));
}

nb::tuple list(const Scene& scene, const Rays& rays, const std::string& word, unsigned threads,
               const nb::object& progress, std::size_t most) {
  const auto data = scene.data();
  const Precision precision = precision_of(word);
  const std::size_t levels = data->view().header->levels;
  std::vector<BlockHits> blocks((rays.size() + kBlock - 1) / kBlock, BlockHits(levels));
  for_all_hits(*data, rays, threads, progress,
               [&](const SceneView& view, const Watch& watch, std::size_t first, std::size_t number) {
                 if (number != 0) blocks[first / kBlock] = collected(view, rays, precision, most, watch, first, number);
               });
  return precision == Precision::kDouble ? joined<double>(blocks, rays.size(), levels)
                                         : joined<float>(blocks, rays.size(), levels);
}

}  // namespace

void add_lists(nb::module_& module) {
  module.def("count_hits", &count, nb::arg("scene"), nb::arg("rays"), nb::arg("precision"), nb::arg("threads"),
             nb::arg("progress").none(), nb::arg("result"));
  module.def("list_hits", &list, nb::arg("scene"), nb::arg("rays"), nb::arg("precision"), nb::arg("threads"),
             nb::arg("progress").none(), nb::arg("max_hits"));
}

}  // namespace hiprt::python
