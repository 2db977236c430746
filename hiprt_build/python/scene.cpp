#include <hiprt_build/python/scene.h>

#include <hiprt_build/exec/threads.h>
#include <hiprt_build/file.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/open_scene.h>
#include <hiprt_build/python/arrays.h>
#include <hiprt_build/python/rays.h>
#include <hiprt_build/statistics.h>

#include <nanobind/stl/string.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

namespace hiprt::python {
namespace {

namespace nb = nanobind;

build::Result<ValidateSummary> checked(std::span<const std::byte> bytes, const std::string& name, unsigned threads) {
  const ParallelLoop loop = [&](std::size_t count, const std::function<void(std::size_t)>& body) {
    build::Threads::run(threads, [&] { build::Threads::for_each(count, body); });
  };
  const auto summary = validate(bytes, loop);
  if (summary) return *summary;
  return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput, name + ": " + to_string(summary.error())});
}

std::shared_ptr<const SceneData> open(build::Buffer buffer, const std::string& name, bool validates, unsigned threads) {
  const auto bytes = std::as_const(buffer).bytes();
  if (validates) value_of(checked(bytes, name, threads));
  if (const auto view = open_buffer(bytes); !view) refuse(name + ": " + to_string(view.error()));
  return std::make_shared<const SceneData>(std::move(buffer));
}

Scene load(const std::string& path, bool validates, unsigned threads) {
  const nb::gil_scoped_release without_gil;
  return Scene(open(value_of(build::map_file(path)), path, validates, threads));
}

Scene from_bytes(const InputArray& bytes, bool validates, unsigned threads) {
  if (bytes.ndim() != 1 || bytes.itemsize() != 1 || (bytes.size() > 1 && bytes.stride(0) != 1))
    refuse("a BVH file in memory is one array of bytes without gaps");
  const nb::gil_scoped_release without_gil;
  build::Buffer buffer = build::Buffer::uninitialized(bytes.size());
  if (bytes.size() != 0) std::memcpy(buffer.bytes().data(), bytes.data(), bytes.size());
  return Scene(open(std::move(buffer), "bytes", validates, threads));
}

void save(const Scene& scene, const std::string& path) {
  const nb::gil_scoped_release without_gil;
  const auto data = scene.data();
  value_of(build::write_file(path, data->bytes()));
}

nb::ndarray<nb::numpy, const std::uint8_t> bytes_of(const Scene& scene) {
  auto* const data = new std::shared_ptr<const SceneData>(scene.data());
  const nb::capsule owner(data,
                          [](void* kept) noexcept { delete static_cast<std::shared_ptr<const SceneData>*>(kept); });
  const auto bytes = (*data)->bytes();
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), {bytes.size()}, owner};
}

nb::ndarray<nb::numpy, float> bounds_of(const Scene& scene) {
  const auto data = scene.data();
  const Box& box = data->view().header->bounds;
  NewArray<float> bounds(6);
  std::copy_n(box.min, 3, bounds.data());
  std::copy_n(box.max, 3, bounds.data() + 3);
  return bounds.release({2, 3});
}

nb::dict summary_of(const Scene& scene, unsigned threads) {
  const auto data = scene.data();
  ValidateSummary summary;
  {
    const nb::gil_scoped_release without_gil;
    summary = value_of(checked(data->bytes(), "scene", threads));
  }
  nb::dict result;
  result["nodes"] = summary.nodes;
  result["leaves"] = summary.leaves;
  result["leaf_triangles"] = summary.leaf_triangles;
  result["leaf_customs"] = summary.leaf_customs;
  result["primitives"] = summary.primitives;
  result["dropped"] = summary.dropped;
  result["split"] = summary.split;
  result["depth"] = summary.depth;
  result["instances"] = summary.instances;
  result["objects"] = summary.objects;
  result["stack_need"] = summary.stack_need;
  return result;
}

void add_build(nb::dict& result, const build::BuildStatistics& built) {
  result["builder"] = build::name(built.builder);
  result["dropped_not_finite"] = built.dropped_not_finite;
  result["dropped_degenerate"] = built.dropped_degenerate;
  result["pairs"] = built.pairs;
  result["scratch_bytes_peak"] = built.scratch_bytes_peak;
  result["build_seconds"] = built.total_seconds;
}

nb::dict statistics_of(const Scene& scene) {
  const auto data = scene.data();
  build::TreeStatistics tree;
  {
    const nb::gil_scoped_release without_gil;
    tree = build::measure_tree(data->view());
  }
  nb::dict result;
  result["nodes"] = tree.nodes;
  result["leaves"] = tree.leaves;
  result["leaf_triangles"] = tree.leaf_triangles;
  result["leaf_customs"] = tree.leaf_customs;
  result["depth"] = tree.depth;
  result["fill"] = tree.fill;
  result["pair_fill"] = tree.pair_fill;
  result["sah_cost"] = tree.sah_cost;
  result["sibling_overlap"] = tree.sibling_overlap;
  result["exchange_slack"] = tree.exchange_slack;
  result["bytes"] = data->bytes().size();
  if (data->statistics()) add_build(result, *data->statistics());
  return result;
}

nb::ndarray<nb::numpy, std::uint32_t> instance_ids(const Scene& scene) {
  const auto data = scene.data();
  const auto instances = data->view().instances;
  NewArray<std::uint32_t> ids(instances.size());
  for (std::size_t i = 0; i < instances.size(); ++i) ids.data()[i] = instances[i].id;
  return ids.release({instances.size()});
}

/// The name that bvhbuild --nodes takes.
const char* layout_of(const Scene& scene) {
  switch (scene.data()->view().layout()) {
    case NodeLayout::kFloat:
      return "float";
    case NodeLayout::kPlanes:
      return "planes";
    case NodeLayout::kHalf:
      return "half";
    case NodeLayout::kQuantized:
      return "quantized";
  }
  return "";
}

}  // namespace

SceneData::SceneData(build::Buffer buffer, const std::optional<build::BuildStatistics>& statistics)
    : buffer_(std::move(buffer)), view_(*open_buffer(std::as_const(buffer_).bytes())), statistics_(statistics) {}

void SceneData::prepare(const Watch& watch) const {
  // Larger scenes take longer than Ctrl-C may wait. A thread that keeps this alive goes on with them.
  constexpr std::uint64_t kSmall = 100'000;
  const auto self = shared_from_this();
  const auto work = [self] {
    static_cast<void>(self->host_.scene(self->view_));
    self->prepared_.store(true);
  };
  if (view_.header->primitive_count <= kSmall) return work();
  try {
    std::thread(work).detach();
  } catch (const std::system_error&) {
    return work();  // The machine has no thread left.
  }
  while (!prepared_.load() && !watch.stopped()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

SceneView SceneData::view_for(std::uint64_t rays, const Watch& watch) const {
  const std::uint64_t traced = rays_.fetch_add(rays, std::memory_order_relaxed) + rays;
  if (traced < view_.header->primitive_count) return make_scene_view(view_);
  if (!prepared_.load()) prepare(watch);
  return prepared_.load() ? host_.scene(view_) : make_scene_view(view_);
}

void add_scene(nb::module_& module) {
  constexpr auto kOwned = nb::rv_policy::reference;  // The arrays have owners: no copies.
  nb::class_<Scene>(module, "Scene")
      .def("save", &save, nb::arg("path"))
      .def("validate", &summary_of, nb::arg("threads") = 0)
      .def("statistics", &statistics_of)
      .def_prop_ro("bytes", &bytes_of, kOwned)
      .def_prop_ro("bounds", &bounds_of, kOwned)
      .def_prop_ro("instance_ids", &instance_ids, kOwned)
      .def_prop_ro("layout", &layout_of)
      .def_prop_ro("levels", [](const Scene& scene) { return scene.data()->view().header->levels; })
      .def_prop_ro("geometries", [](const Scene& scene) { return scene.data()->view().geometries.size(); })
      .def_prop_ro("primitives", [](const Scene& scene) { return scene.data()->view().header->primitive_count; });
  module.def("load", &load, nb::arg("path"), nb::arg("validate"), nb::arg("threads"));
  module.def("from_bytes", &from_bytes, nb::arg("bytes"), nb::arg("validate"), nb::arg("threads"));
}

}  // namespace hiprt::python
