#include <hiprt_build/python/gpu/queries.h>

#include <hiprt_build/python/errors.h>
#include <hiprt_build/python/gpu/device/batch.h>
#include <hiprt_build/python/gpu/kernel_source.h>
#include <hiprt_build/python/gpu/memory.h>
#include <hiprt_build/python/gpu/modules.h>
#include <hiprt_build/python/queries.h>
#include <hiprt_build/python/scene.h>

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace hiprt::python::gpu {
namespace {

namespace nb = nanobind;

Device device_of(bool is_hip, int number) { return {&Driver::of(is_hip ? Platform::kHip : Platform::kCuda), number}; }

template <class T> T* pointer(std::uint64_t address) {
  return reinterpret_cast<T*>(static_cast<std::uintptr_t>(address));
}

/// @param description a list of one or three numbers; or (address, strides per dimension, stride of components, kind)
/// with strides in bytes.
Column column_of(const nb::handle& description) {
  Column column{};
  if (!nb::isinstance<nb::tuple>(description)) {
    const auto values = nb::cast<std::vector<double>>(description);
    std::copy_n(values.begin(), std::min<std::size_t>(values.size(), 3), column.values);
    return column;
  }
  const auto parts = nb::borrow<nb::tuple>(description);
  column.first = pointer<const std::byte>(nb::cast<std::uint64_t>(parts[0]));
  const auto strides = nb::cast<std::vector<std::int64_t>>(parts[1]);
  for (std::size_t d = 0; d < strides.size() && d < kMostDimensions; ++d) column.strides[d] = strides[d];
  column.component = nb::cast<std::int64_t>(parts[2]);
  column.kind = static_cast<NumberKind>(nb::cast<unsigned>(parts[3]));
  return column;
}

BatchShape shape_of(const std::vector<std::uint64_t>& lengths) {
  BatchShape shape{1, {1, 1, 1, 1}};
  for (std::size_t d = 0; d < lengths.size() && d < kMostDimensions; ++d) {
    shape.lengths[d] = lengths[d];
    shape.size *= lengths[d];
  }
  return shape;
}

RayInput rays_of(const std::vector<std::uint64_t>& lengths, const nb::tuple& columns) {
  return {shape_of(lengths),     column_of(columns[0]), column_of(columns[1]), column_of(columns[2]),
          column_of(columns[3]), column_of(columns[4]), column_of(columns[5])};
}

/// Refuses scenes that a GPU cannot trace.
void check_scene(const SceneView& scene, Answer answer) {
  answer == Answer::kPoint ? check_findable(scene) : check_traceable(scene);
  if (scene.stack_bound > kMostGpuEntries)
    refuse("the scene needs a stack of " + std::to_string(scene.stack_bound) + " entries, and a GPU traces up to " +
           std::to_string(kMostGpuEntries) + ": trace it on the CPU");
}

/// Enqueues a query. The GIL is released.
template <class Job>
void enqueue(const Scene& scene, Device device, Stream stream, Answer answer, Precision precision, Job job,
             std::uint64_t size) {
  if (size == 0) return;
  const auto data = scene.data();
  const nb::gil_scoped_release without_gil;
  const SceneView view = make_scene_view(data->view());
  check_scene(view, answer);
  const std::uint64_t blocks = (size + kBlockThreads - 1) / kBlockThreads;
  if (blocks > 0x7fffffffu) refuse("a GPU takes at most 2^38 queries at once, and there are " + std::to_string(size));
  const CurrentDevice current(*device.driver, device.number);
  const Function kernel = kernel_of(*device.driver, device.number, kernel_source(view, answer, precision));
  SceneView on_device = data->on_gpu(device, stream);
  void* arguments[] = {&on_device, &job, &size};
  device.driver->launch(kernel, static_cast<unsigned>(blocks), kBlockThreads, stream, arguments);
}

/// Copies the scene to a device, if it is not there. The GIL is released.
void copy_scene(const Scene& scene, bool is_hip, int number) {
  const Device device = device_of(is_hip, number);
  const auto data = scene.data();
  const nb::gil_scoped_release without_gil;
  const CurrentDevice current(*device.driver, device.number);
  data->on_gpu(device, nullptr);
}

using Lengths = std::vector<std::uint64_t>;
using Addresses = std::vector<std::uint64_t>;

void cast(const Scene& scene, bool is_hip, int device, std::uint64_t stream, const std::string& precision,
          const Lengths& lengths, const nb::tuple& columns, const Addresses& to) {
  CastJob job{rays_of(lengths, columns), pointer<void>(to.at(0)),          pointer<void>(to.at(1)),
              pointer<void>(to.at(2)),   pointer<std::uint32_t>(to.at(3)), pointer<std::uint32_t>(to.at(4)),
              pointer<void>(to.at(5)),   pointer<float>(to.at(6)),         pointer<std::uint32_t>(to.at(7))};
  enqueue(scene, device_of(is_hip, device), pointer<void>(stream), Answer::kCast, precision_of(precision), job,
          job.rays.shape.size);
}

void occluded(const Scene& scene, bool is_hip, int device, std::uint64_t stream, const std::string& precision,
              const Lengths& lengths, const nb::tuple& columns, const Addresses& to) {
  const OccludedJob job{rays_of(lengths, columns), pointer<bool>(to.at(0))};
  enqueue(scene, device_of(is_hip, device), pointer<void>(stream), Answer::kOccluded, precision_of(precision), job,
          job.rays.shape.size);
}

void count(const Scene& scene, bool is_hip, int device, std::uint64_t stream, const std::string& precision,
           const Lengths& lengths, const nb::tuple& columns, const Addresses& to) {
  const CountJob job{rays_of(lengths, columns), pointer<std::uint32_t>(to.at(0))};
  enqueue(scene, device_of(is_hip, device), pointer<void>(stream), Answer::kCount, precision_of(precision), job,
          job.rays.shape.size);
}

void closest_point(const Scene& scene, bool is_hip, int device, std::uint64_t stream, bool is_double,
                   const Lengths& lengths, const nb::tuple& columns, const Addresses& to) {
  const PointJob job{shape_of(lengths),
                     column_of(columns[0]),
                     column_of(columns[1]),
                     column_of(columns[2]),
                     column_of(columns[3]),
                     pointer<void>(to.at(0)),
                     pointer<void>(to.at(1)),
                     pointer<void>(to.at(2)),
                     pointer<void>(to.at(3)),
                     pointer<std::uint32_t>(to.at(4)),
                     pointer<std::uint32_t>(to.at(5)),
                     pointer<std::uint8_t>(to.at(6)),
                     pointer<std::uint32_t>(to.at(7))};
  enqueue(scene, device_of(is_hip, device), pointer<void>(stream), Answer::kPoint,
          is_double ? Precision::kDouble : Precision::kWatertight, job, job.shape.size);
}

/// @param query "cast", "occluded", "count" or "closest_point".
std::size_t compile(const Scene& scene, const std::string& query, const std::string& precision,
                    const std::string& architecture) {
  const nb::gil_scoped_release without_gil;
  const Answer answer = query == "cast"       ? Answer::kCast
                        : query == "occluded" ? Answer::kOccluded
                        : query == "count"    ? Answer::kCount
                                              : Answer::kPoint;
  const SceneView view = make_scene_view(scene.data()->view());
  check_scene(view, answer);
  return code_of(kernel_source(view, answer, precision_of(precision)), architecture).size();
}

/// What a DLPack capsule says of a tensor, which it keeps alive.
struct View {
  nb::ndarray<nb::ro> array;

  nb::list lengths(bool strides) const {
    nb::list result;
    for (std::size_t d = 0; d < array.ndim(); ++d)
      strides ? result.append(array.stride(d)) : result.append(array.shape(d));
    return result;
  }
  std::string type() const {
    const auto dtype = array.dtype();
    switch (static_cast<nb::dlpack::dtype_code>(dtype.code)) {
      case nb::dlpack::dtype_code::Int:
        return "int" + std::to_string(dtype.bits);
      case nb::dlpack::dtype_code::UInt:
        return "uint" + std::to_string(dtype.bits);
      case nb::dlpack::dtype_code::Float:
        return "float" + std::to_string(dtype.bits);
      case nb::dlpack::dtype_code::Bool:
        return "bool";
      default:
        return "DLPack type " + std::to_string(dtype.code);
    }
  }
};

nb::dlpack::dtype type_of(const std::string& name) {
  if (name == "float64") return nb::dtype<double>();
  if (name == "uint32") return nb::dtype<std::uint32_t>();
  if (name == "uint8") return nb::dtype<std::uint8_t>();
  if (name == "bool") return nb::dtype<bool>();
  if (name == "float32") return nb::dtype<float>();
  refuse("results have no type " + name);
}

/// A DLPack capsule of a part of the memory, which the capsule keeps alive.
nb::ndarray<> tensor_of(const nb::object& memory, std::uint64_t address, const std::vector<std::size_t>& lengths,
                        const std::string& type) {
  const Device device = nb::cast<const Memory&>(memory).device();
  const int kind = device.driver->platform() == Platform::kHip ? nb::device::rocm::value : nb::device::cuda::value;
  return nb::ndarray<>(pointer<void>(address), lengths.size(), lengths.data(), memory, nullptr, type_of(type), kind,
                       device.number);
}

std::uintptr_t new_stream(bool is_hip, int number) {
  const Device device = device_of(is_hip, number);
  const CurrentDevice current(*device.driver, device.number);
  return reinterpret_cast<std::uintptr_t>(device.driver->make_stream());
}

void add_memory(nb::module_& module) {
  nb::class_<View>(module, "GpuView", "What a DLPack capsule says of a tensor, which it keeps alive.")
      .def(
          "__init__", [](View* self, nb::ndarray<nb::ro> array) { new (self) View{std::move(array)}; },
          nb::arg("capsule"))
      .def_prop_ro("address", [](const View& view) { return reinterpret_cast<std::uintptr_t>(view.array.data()); })
      .def_prop_ro("shape", [](const View& view) { return view.lengths(false); })
      .def_prop_ro(
          "strides", [](const View& view) { return view.lengths(true); }, "In elements.")
      .def_prop_ro("type", &View::type);
  nb::class_<Memory>(module, "GpuMemory", "Memory of a GPU. When it dies, the device is waited for.")
      .def(
          "__init__",
          [](Memory* self, bool is_hip, int device, std::size_t bytes) {
            new (self) Memory(device_of(is_hip, device), bytes);
          },
          nb::arg("is_hip"), nb::arg("device"), nb::arg("bytes"))
      .def_prop_ro("address", [](const Memory& memory) { return reinterpret_cast<std::uintptr_t>(memory.data()); });
  nb::class_<StreamPoint>(module, "GpuPoint", "A point in a stream, behind the work that is there.")
      .def(
          "__init__",
          [](StreamPoint* self, bool is_hip, int device, std::uint64_t stream) {
            new (self) StreamPoint(device_of(is_hip, device), pointer<void>(stream));
          },
          nb::arg("is_hip"), nb::arg("device"), nb::arg("stream"))
      .def_prop_ro("is_done", &StreamPoint::is_done)
      .def(
          "let_wait", [](const StreamPoint& point, std::uint64_t stream) { point.let_wait(pointer<void>(stream)); },
          nb::arg("stream"))
      .def("synchronize", &StreamPoint::synchronize, nb::call_guard<nb::gil_scoped_release>());
  module.def("gpu_tensor", &tensor_of, nb::arg("memory"), nb::arg("address"), nb::arg("shape"), nb::arg("type"),
             "A DLPack capsule of a part of a GpuMemory.");
}

}  // namespace

void add_gpu(nb::module_& module) {
  add_memory(module);
  const auto add = [&](const char* name, auto function, const char* policy) {
    module.def(name, function, nb::arg("scene"), nb::arg("is_hip"), nb::arg("device"), nb::arg("stream"),
               nb::arg(policy), nb::arg("lengths"), nb::arg("columns"), nb::arg("to"));
  };
  add("gpu_cast", &cast, "precision");
  add("gpu_occluded", &occluded, "precision");
  add("gpu_count", &count, "precision");
  add("gpu_closest_point", &closest_point, "is_double");
  module.def("gpu_compile", &compile, nb::arg("scene"), nb::arg("query"), nb::arg("precision"), nb::arg("architecture"),
             "Size in bytes of the kernel of a query. It needs no GPU.");
  module.def("gpu_copy_scene", &copy_scene, nb::arg("scene"), nb::arg("is_hip"), nb::arg("device"),
             "Copies a scene to the memory of a GPU before the first query.");
  module.def("gpu_set_compiler_paths", &set_compiler_paths, nb::arg("paths"));
  module.def(
      "gpu_check_driver", [](bool is_hip) { device_of(is_hip, 0); }, nb::arg("is_hip"),
      "Raises GpuError without a driver or a GPU.");
  module.def("gpu_stream", &new_stream, nb::arg("is_hip"), nb::arg("device"),
             "A new stream, which lives until the end of the process.");
  module.def(
      "gpu_device_of",
      [](bool is_hip, std::uint64_t address) { return device_of(is_hip, 0).driver->device_of(pointer<void>(address)); },
      nb::arg("is_hip"), nb::arg("address"), "Number of the device that has the memory.");
}

}  // namespace hiprt::python::gpu
