#include <hiprt_build/python/arrays.h>
#include <hiprt_build/python/block_list.h>
#include <hiprt_build/python/errors.h>
#include <hiprt_build/python/queries.h>
#include <hiprt_build/python/tracers/tracers.h>

#include <nanobind/stl/string.h>

#include <algorithm>
#include <vector>

namespace hiprt::python {
namespace {

namespace nb = nanobind;

using BlockHits = BlockList<ListedHit, &ListedHit::t>;

template <class Real>
void collect(const SceneView& scene, const Rays& rays, Precision precision, std::size_t most, const Watch& watch,
             std::size_t first, std::size_t count, BlockHits& hits) {
  BasicRay<Real> block[kBlock];
  rays.gather(first, count, block);
  Collector<ListedHit, &ListedHit::t> collector{hits, watch, most};
  trace({&scene, Query::kAll, precision, block, nullptr, nullptr, count, collector.sink()});
  collector.finish(count);
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

template <class Real>
void count_block(const SceneView& scene, const Rays& rays, Precision precision, const Watch& watch, std::size_t first,
                 std::size_t count, std::uint32_t* counts) {
  BasicRay<Real> block[kBlock];
  rays.gather(first, count, block);
  std::fill_n(counts, count, 0u);
  Counter<ListedHit> counter{counts, watch};
  trace({&scene, Query::kAll, precision, block, nullptr, nullptr, count, counter.sink()});
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
                 collected(view, rays, precision, ~std::size_t{0}, watch, first, number).count_to(to + first);
               });
}

/// The arrays of a list.
template <class Real> nb::tuple joined(const std::vector<BlockHits>& blocks, std::size_t rays, std::size_t levels) {
  const std::size_t total = total_of(blocks);
  ListArrays arrays(rays, total, levels);
  NewArray<Real> t(total), u(total), v(total);
  {
    const nb::gil_scoped_release without_gil;
    join(blocks, arrays, [&](std::size_t to, const ListedHit& hit) {
      t.data()[to] = static_cast<Real>(hit.t);
      u.data()[to] = static_cast<Real>(hit.u);
      v.data()[to] = static_cast<Real>(hit.v);
    });
  }
  return nb::make_tuple(arrays.offsets.release({rays + 1}), t.release({total}), u.release({total}), v.release({total}),
                        arrays.geometry.release({total}), arrays.primitive.release({total}),
                        arrays.paths.release({total, levels}));
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
