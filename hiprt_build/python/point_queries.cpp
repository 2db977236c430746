#include <hiprt_build/python/arrays.h>
#include <hiprt_build/python/block_list.h>
#include <hiprt_build/python/points.h>
#include <hiprt_build/python/queries.h>
#include <hiprt_build/python/tracers/tracers.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace hiprt::python {
namespace {

namespace nb = nanobind;

/// Points of one task: few enough to lie on a thread's stack.
using Block = PointQueryD[kBlock];

/// Where closest points go, one array per member.
template <class Real> struct PointColumns {
  Real *distance, *point, *u, *v;
  std::uint8_t* feature;

  void put(std::size_t to, const ListedPoint& found) const {
    distance[to] = static_cast<Real>(square_root(found.distance_squared));
    for (int axis = 0; axis < 3; ++axis)
      point[3 * to + static_cast<std::size_t>(axis)] = static_cast<Real>(found.point[axis]);
    u[to] = static_cast<Real>(found.u);
    v[to] = static_cast<Real>(found.v);
    feature[to] = static_cast<std::uint8_t>(found.feature);
  }
};

/// The arrays of nearest(): @p most entries per point.
template <class Real> struct NearestArrays {
  PointColumns<Real> columns;
  std::uint32_t *geometry, *primitive, *paths;
  std::size_t most, levels;

  NearestArrays(const nb::tuple& arrays, std::size_t points, std::size_t most_of_each, std::size_t scene_levels)
      : most(most_of_each), levels(scene_levels) {
    const auto array = [&](std::size_t i) { return nb::cast<OutputArray>(arrays[i]); };
    const std::size_t size = points * most;
    columns.distance = data_of<Real>(array(0), "distance", size);
    columns.point = data_of<Real>(array(1), "point", 3 * size);
    columns.u = data_of<Real>(array(2), "u", size);
    columns.v = data_of<Real>(array(3), "v", size);
    geometry = data_of<std::uint32_t>(array(4), "geometry", size);
    primitive = data_of<std::uint32_t>(array(5), "primitive", size);
    columns.feature = data_of<std::uint8_t>(array(6), "feature", size);
    paths = data_of<std::uint32_t>(array(7), "instances", levels * size);
  }

  void put(std::size_t to, const ListedPoint& found, const std::uint32_t* path) const {
    columns.put(to, found);
    geometry[to] = found.geometry;
    primitive[to] = found.primitive;
    std::copy_n(path, levels, paths + to * levels);
  }

  /// Makes the entries of points such that nothing was found.
  void clear(std::size_t first, std::size_t count) const {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    const ListedPoint nothing{std::numeric_limits<double>::infinity(),
                              BasicVec3<double>(kNone, kNone, kNone),
                              0,
                              0,
                              kInvalidId,
                              kInvalidId,
                              TriangleFeature::kFace};
    std::uint32_t no_path[kMostLevels];
    std::fill_n(no_path, kMostLevels, kInvalidId);
    for (std::size_t to = first * most; to < (first + count) * most; ++to) put(to, nothing, no_path);
  }
};

/// Puts the points of a block, which come in order, into the arrays.
template <class Real> struct NearestSink {
  const NearestArrays<Real>& to;
  const Watch& watch;
  std::size_t first;  ///< Point of the block.
  std::size_t last_query = 0, rank = 0;

  static bool take(void* self_pointer, std::size_t query, const ListedPoint& found, const std::uint32_t* path) {
    auto& self = *static_cast<NearestSink*>(self_pointer);
    self.rank = query == self.last_query ? self.rank : 0;
    self.last_query = query;
    self.to.put((self.first + query) * self.to.most + self.rank++, found, path);
    return !self.watch.stopped();
  }
};

template <class Real>
void nearest_as(const SceneData& data, const Points& points, std::uint32_t most, unsigned threads,
                const nb::object& progress, const nb::tuple& arrays) {
  const NearestArrays<Real> to(arrays, points.size(), most, data.view().header->levels);
  Watch watch(points.size());
  run_watched(progress, watch, points.size() * most <= kBlock, [&] {
    const SceneView scene = make_scene_view(data.view());
    check_findable(scene);
    for_blocks(points.size(), threads, watch, [&](std::size_t first, std::size_t count) {
      Block block;
      points.gather<Real>(first, count, block);
      to.clear(first, count);
      const auto scratch = std::make_unique_for_overwrite<std::byte[]>(most * kPathPointBytes);
      NearestSink<Real> sink{to, watch, first};
      check_done(find(PointJob{&scene, block, count, most, scratch.get(), {&NearestSink<Real>::take, &sink}}));
    });
  });
}

void nearest(const Scene& scene, const Points& points, bool is_double, std::uint32_t most, unsigned threads,
             const nb::object& progress, const nb::tuple& arrays) {
  if (most == 0) refuse("nearest: the number of points is 0");
  const auto data = scene.data();
  is_double ? nearest_as<double>(*data, points, most, threads, progress, arrays)
            : nearest_as<float>(*data, points, most, threads, progress, arrays);
}

using BlockPoints = BlockList<ListedPoint, &ListedPoint::distance_squared>;

template <class Real> nb::tuple joined(const std::vector<BlockPoints>& blocks, std::size_t points, std::size_t levels) {
  const std::size_t total = total_of(blocks);
  ListArrays arrays(points, total, levels);
  NewArray<Real> distance(total), point(3 * total), u(total), v(total);
  NewArray<std::uint8_t> feature(total);
  {
    const nb::gil_scoped_release without_gil;
    const PointColumns<Real> columns{distance.data(), point.data(), u.data(), v.data(), feature.data()};
    join(blocks, arrays, [&](std::size_t to, const ListedPoint& found) { columns.put(to, found); });
  }
  return nb::make_tuple(arrays.offsets.release({points + 1}), distance.release({total}), point.release({total, 3}),
                        u.release({total}), v.release({total}), arrays.geometry.release({total}),
                        arrays.primitive.release({total}), feature.release({total}),
                        arrays.paths.release({total, levels}));
}

template <class Real>
nb::tuple within_as(const SceneData& data, const Points& points, unsigned threads, const nb::object& progress) {
  const std::size_t levels = data.view().header->levels;
  std::vector<BlockPoints> blocks((points.size() + kBlock - 1) / kBlock, BlockPoints(levels));
  Watch watch(points.size());
  // Many triangles may be within the distance of a few points.
  constexpr std::size_t kFew = 16;
  run_watched(progress, watch, points.size() <= kFew, [&] {
    const SceneView scene = make_scene_view(data.view());
    check_findable(scene);
    for_blocks(points.size(), threads, watch, [&](std::size_t first, std::size_t count) {
      if (count == 0) return;
      Block block;
      points.gather<Real>(first, count, block);
      BlockPoints found(levels);
      Collector<ListedPoint, &ListedPoint::distance_squared> collector{found, watch};
      check_done(find(PointJob{&scene, block, count, 0, nullptr, collector.sink()}));
      collector.finish(count);
      blocks[first / kBlock] = std::move(found);
    });
  });
  return joined<Real>(blocks, points.size(), levels);
}

nb::tuple within(const Scene& scene, const Points& points, bool is_double, unsigned threads,
                 const nb::object& progress) {
  const auto data = scene.data();
  return is_double ? within_as<double>(*data, points, threads, progress)
                   : within_as<float>(*data, points, threads, progress);
}

}  // namespace

void add_point_queries(nb::module_& module) {
  module.def("nearest", &nearest, nb::arg("scene"), nb::arg("points"), nb::arg("is_double"), nb::arg("most"),
             nb::arg("threads"), nb::arg("progress").none(), nb::arg("arrays"));
  module.def("within", &within, nb::arg("scene"), nb::arg("points"), nb::arg("is_double"), nb::arg("threads"),
             nb::arg("progress").none());
  module.def(
      "check_findable", [](const Scene& scene) { check_findable(make_scene_view(scene.data()->view())); },
      nb::arg("scene"), "Refuses scenes with primitives that are not triangles.");
}

}  // namespace hiprt::python
