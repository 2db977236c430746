#include <hiprt_build/python/build.h>

#include <hiprt_build/build.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/python/errors.h>
#include <hiprt_build/python/options.h>
#include <hiprt_build/python/rays.h>
#include <hiprt_build/python/scene.h>
#include <hiprt_build/python/watch.h>
#include <hiprt_build/refit.h>

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <string>
#include <utility>
#include <vector>

namespace hiprt::python {
namespace {

namespace nb = nanobind;

/// Below this number of primitives a build takes milliseconds.
constexpr std::uint64_t kSmall = 2000;

/// Meshes of a build: the arrays of Python, and views of them.
struct Meshes {
  std::vector<std::string> names;
  std::vector<InputArray> arrays;
  std::vector<build::TriangleMesh> meshes;
  std::uint64_t triangles = 0;
};

/// Rows of three numbers.
template <class Element> build::StridedSpan<Element> rows_of(const InputArray& array, const char* name) {
  using Number = typename Element::value_type;
  const bool fits = array.dtype() == nb::dtype<Number>() && array.ndim() == 2 && array.shape(1) == 3;
  if (!fits || (array.shape(0) > 1 && array.stride(0) < 3) || (array.size() != 0 && array.stride(1) != 1))
    refuse(std::string(name) + ": the array is not n x 3, or has another type or strides than were asked for");
  if (array.shape(0) < 2) return {static_cast<const Element*>(array.data()), array.shape(0)};
  return {array.data(), array.shape(0), static_cast<std::size_t>(array.stride(0)) * sizeof(Number)};
}

/// @param list of (vertices, indices or None, mask, name).
Meshes meshes_from(const nb::list& list) {
  Meshes result;
  result.names.reserve(list.size());
  for (const nb::handle entry : list) {
    const auto parts = nb::cast<nb::tuple>(entry);
    build::TriangleMesh mesh;
    result.arrays.push_back(nb::cast<InputArray>(parts[0]));
    mesh.positions = rows_of<build::Position>(result.arrays.back(), "vertices");
    mesh.implicit_triangles = parts[1].is_none();
    if (!mesh.implicit_triangles) {
      result.arrays.push_back(nb::cast<InputArray>(parts[1]));
      mesh.triangles = rows_of<build::Triangle>(result.arrays.back(), "indices");
    }
    mesh.mask = nb::cast<std::uint32_t>(parts[2]);
    mesh.name = result.names.emplace_back(nb::cast<std::string>(parts[3]));
    result.triangles += mesh.implicit_triangles ? mesh.positions.size() / 3 : mesh.triangles.size();
    result.meshes.push_back(mesh);
  }
  return result;
}

/// Runs operation(callback), which returns a Result, and reports its fraction of @p units.
template <class Operation>
auto watched(const nb::object& progress, std::uint64_t units, bool small, const Operation& operation) {
  Watch watch(units);
  const build::ProgressCallback callback = [&](const build::Progress& at) {
    watch.set(static_cast<std::uint64_t>(at.fraction * static_cast<double>(units)));
    return !watch.stopped();
  };
  std::invoke_result_t<const Operation&, const build::ProgressCallback&> result =
      tl::unexpected(build::Error{build::ErrorCode::kCancelled, "cancelled"});
  run_watched(progress, watch, small, [&] { result = operation(callback); });
  return value_of(std::move(result));
}

Scene scene_of(build::Bvh bvh) {
  return Scene(std::make_shared<const SceneData>(std::move(bvh.buffer), bvh.statistics));
}

Scene build_meshes(const nb::list& list, const nb::dict& words, const nb::object& progress) {
  const Meshes input = meshes_from(list);
  build::BuildOptions options = options_from(words, {});
  options.tool = "hiprt for Python";
  return scene_of(watched(progress, input.triangles, input.triangles < kSmall, [&](const auto& callback) {
    options.progress = callback;
    return build::build(input.meshes, options);
  }));
}

nb::dict refit_scene(Scene& scene, const nb::list& list, unsigned threads, const nb::object& progress) {
  const Meshes moved = meshes_from(list);
  const auto data = scene.data();
  build::RefittedBvh refitted = watched(progress, moved.triangles, moved.triangles < kSmall, [&](const auto& callback) {
    return build::refit_copy(data->bytes(), {.meshes = moved.meshes}, {.threads = threads, .progress = callback});
  });
  scene.replace(std::make_shared<const SceneData>(std::move(refitted.buffer), data->statistics()));
  nb::dict result;
  result["rebuild_advised"] = refitted.statistics.rebuild_advised;
  result["sah_cost"] = refitted.statistics.sah_cost;
  result["sah_cost_built"] = refitted.statistics.sah_cost_built;
  result["cost_ratio"] = refitted.statistics.cost_ratio;
  result["exchange_slack"] = refitted.statistics.exchange_slack;
  result["exchange_slack_built"] = refitted.statistics.exchange_slack_built;
  result["seconds"] = refitted.statistics.total_seconds;
  return result;
}

/// A group of instances: arrays of one entry per instance.
struct Group {
  std::vector<build::Instance> instances;
  std::vector<build::Motion> motions;  ///< Empty if the group stands still.
};

build::Affine affine_at(const float* numbers) {
  build::Affine affine;
  for (auto& row : affine.row)
    for (float& x : row) x = *numbers++;
  return affine;
}

/// @param entry (objects uint32 k, transforms float32 k x times x 3 x 4, times float32, masks uint32 k, ids uint32 k,
/// kind of motion). All without gaps.
Group group_from(const nb::tuple& entry) {
  const auto objects = nb::cast<InputArray>(entry[0]), transforms = nb::cast<InputArray>(entry[1]),
             times = nb::cast<InputArray>(entry[2]), masks = nb::cast<InputArray>(entry[3]),
             ids = nb::cast<InputArray>(entry[4]);
  const std::size_t count = objects.size(), keys = times.size();
  Group group;
  group.instances.resize(count);
  if (keys > 1) group.motions.resize(count);
  const auto* matrix = static_cast<const float*>(transforms.data());
  for (std::size_t i = 0; i < count; ++i) {
    build::Instance& instance = group.instances[i];
    instance.object = static_cast<const std::uint32_t*>(objects.data())[i];
    instance.mask = static_cast<const std::uint32_t*>(masks.data())[i];
    instance.id = static_cast<const std::uint32_t*>(ids.data())[i];
    instance.to_scene = affine_at(matrix);
    if (keys > 1) {
      group.motions[i].kind = static_cast<MotionKind>(nb::cast<unsigned>(entry[5]));
      for (std::size_t k = 0; k < keys; ++k)
        group.motions[i].matrices.push_back({static_cast<const float*>(times.data())[k], affine_at(matrix + 12 * k)});
      instance.motion = &group.motions[i];
    }
    matrix += 12 * keys;
  }
  return group;
}

Scene build_groups(const nb::list& files, const nb::list& list, const nb::dict& words, const nb::object& progress) {
  std::vector<std::shared_ptr<const SceneData>> kept;
  std::vector<std::span<const std::byte>> bytes;
  for (const nb::handle file : files) {
    kept.push_back(nb::cast<const Scene&>(file).data());
    bytes.push_back(kept.back()->bytes());
  }
  std::vector<Group> groups;
  std::uint64_t instances = 0;
  for (const nb::handle entry : list) {
    groups.push_back(group_from(nb::cast<nb::tuple>(entry)));
    instances += groups.back().instances.size();
  }
  const std::vector<std::span<const build::Instance>> views = [&] {
    std::vector<std::span<const build::Instance>> result;
    for (const Group& group : groups) result.push_back(group.instances);
    return result;
  }();
  build::InstanceOptions options;
  options.tree = options_from(words, options.tree);
  options.tree.tool = "hiprt for Python";
  return scene_of(watched(progress, instances, false, [&](const auto& callback) {
    options.tree.progress = callback;
    return build::build_instances(build::InstancedScene{bytes, views}, options);
  }));
}

}  // namespace

void add_build(nb::module_& module) {
  module.def("build", &build_meshes, nb::arg("meshes"), nb::arg("options"), nb::arg("progress").none());
  module.def("build_instances", &build_groups, nb::arg("files"), nb::arg("groups"), nb::arg("options"),
             nb::arg("progress").none());
  module.def("refit", &refit_scene, nb::arg("scene"), nb::arg("meshes"), nb::arg("threads"),
             nb::arg("progress").none());
}

}  // namespace hiprt::python
