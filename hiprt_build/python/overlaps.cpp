#include <hiprt_build/python/arrays.h>
#include <hiprt_build/python/block_list.h>
#include <hiprt_build/python/points.h>
#include <hiprt_build/python/queries.h>
#include <hiprt_build/python/tracers/tracers.h>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace hiprt::python {
namespace {

namespace nb = nanobind;

/// Boxes of one task, and what they see.
struct BlockBoxes {
  Box boxes[kBlock];
  Visibility visible[kBlock];

  BlockBoxes(const Points& low, const Points& high, std::size_t first, std::size_t count) {
    PointQueryD corners[kBlock];
    low.gather<float>(first, count, corners);
    for (std::size_t i = 0; i < count; ++i) {
      for (int axis = 0; axis < 3; ++axis) boxes[i].min[axis] = static_cast<float>(corners[i].point[axis]);
      visible[i] = {corners[i].mask, corners[i].time};
    }
    high.gather<float>(first, count, corners);
    for (std::size_t i = 0; i < count; ++i)
      for (int axis = 0; axis < 3; ++axis) boxes[i].max[axis] = static_cast<float>(corners[i].point[axis]);
  }
};

using BlockOverlaps = BlockList<ListedOverlap, nullptr>;

BlockOverlaps collected(const SceneView& scene, const BlockBoxes& block, std::size_t count, const Watch& watch) {
  BlockOverlaps found(scene.levels);
  Collector<ListedOverlap, nullptr> collector{found, watch};
  check_done(find(OverlapJob{&scene, block.boxes, block.visible, count, collector.sink()}));
  collector.finish(count);
  return found;
}

/// Calls body(scene, watch, first, count) for every block of boxes.
template <class Body>
void for_all_boxes(const SceneData& data, const Points& low, const Points& high, unsigned threads,
                   const nb::object& progress, const Body& body) {
  if (low.size() != high.size()) refuse("overlap: the numbers of lower and upper corners differ");
  Watch watch(low.size());
  // Many triangles may touch a few boxes.
  constexpr std::size_t kFew = 16;
  run_watched(progress, watch, low.size() <= kFew, [&] {
    const SceneView scene = make_scene_view(data.view());
    check_findable(scene);
    for_blocks(low.size(), threads, watch, [&](std::size_t first, std::size_t count) {
      if (count != 0) body(scene, watch, first, count);
    });
  });
}

nb::tuple overlap(const Scene& scene, const Points& low, const Points& high, unsigned threads,
                  const nb::object& progress) {
  const auto data = scene.data();
  const std::size_t levels = data->view().header->levels, boxes = low.size();
  std::vector<BlockOverlaps> blocks((boxes + kBlock - 1) / kBlock, BlockOverlaps(levels));
  for_all_boxes(*data, low, high, threads, progress,
                [&](const SceneView& view, const Watch& watch, std::size_t first, std::size_t count) {
                  blocks[first / kBlock] = collected(view, BlockBoxes(low, high, first, count), count, watch);
                });
  const std::size_t total = total_of(blocks);
  ListArrays arrays(boxes, total, levels);
  {
    const nb::gil_scoped_release without_gil;
    join(blocks, arrays, [](std::size_t, const ListedOverlap&) {});
  }
  return nb::make_tuple(arrays.offsets.release({boxes + 1}), arrays.geometry.release({total}),
                        arrays.primitive.release({total}), arrays.paths.release({total, levels}));
}

void count_overlaps(const Scene& scene, const Points& low, const Points& high, unsigned threads,
                    const nb::object& progress, const OutputArray& result) {
  const auto data = scene.data();
  std::uint32_t* const to = data_of<std::uint32_t>(result, "count", low.size());
  for_all_boxes(*data, low, high, threads, progress,
                [&](const SceneView& view, const Watch& watch, std::size_t first, std::size_t count) {
                  const BlockBoxes block(low, high, first, count);
                  if (!may_repeat(view)) {
                    std::fill_n(to + first, count, 0u);
                    Counter<ListedOverlap> counter{to + first, watch};
                    return check_done(find(OverlapJob{&view, block.boxes, block.visible, count, counter.sink()}));
                  }
                  collected(view, block, count, watch).count_to(to + first);
                });
}

}  // namespace

void add_overlaps(nb::module_& module) {
  module.def("overlap", &overlap, nb::arg("scene"), nb::arg("low"), nb::arg("high"), nb::arg("threads"),
             nb::arg("progress").none());
  module.def("count_overlaps", &count_overlaps, nb::arg("scene"), nb::arg("low"), nb::arg("high"), nb::arg("threads"),
             nb::arg("progress").none(), nb::arg("result"));
}

}  // namespace hiprt::python
