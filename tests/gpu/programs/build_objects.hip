#include <hiprt_build/gpu/launch.h>
#include <hiprt_build/gpu/objects.h>
#include <hiprt_device/hiprt_device.h>

#include <cstdio>
#include <cstdlib>

using namespace hiprt;

template <class T> T must(gpu::Result<T> result) {
  if (!result) std::exit(std::puts(result.error().message.c_str()) < 0 ? 2 : 1);
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

__global__ void trace(const gpu::InstanceReport* scene, Hit* hit) {
  *hit = closest_hit<Instanced<Policies>>(scene->view, Ray{.origin = {0.2f, 0.2f, 9}, .direction = {0, 0, -1}});
}

int main() {
  gpu::DeviceAllocator memory;
  const auto bytes = [&](std::uint64_t size) { return must(gpu::DeviceBuffer::make(size, nullptr, memory)); };
  const build::Position corners[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const auto positions = must(gpu::DeviceArray<build::Position>::from(corners, nullptr, memory));
  const gpu::DeviceGeometry mesh{
      .positions = positions.data(), .position_count = 3, .primitive_count = 1, .implicit_triangles = true};
  // Build the object. A scene may have many objects in separate allocations.
  const gpu::BuildSizes sizes = must(gpu::build_sizes({&mesh, 1}));
  auto object = bytes(sizes.output), scratch = bytes(sizes.scratch), records = bytes(sizeof(ObjectRecord));
  const auto built = must(gpu::enqueue_build({&mesh, 1}, {}, object.data(), scratch.data(), nullptr));
  auto* record = reinterpret_cast<ObjectRecord*>(records.data());
  must(gpu::enqueue_objects({{gpu::object_of(built)}}, record, nullptr));
  // Build the scene: one instance at the origin, one moved by 4 along z.
  const gpu::DeviceInstance two[] = {{}, {.to_scene = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 4}}}}};
  const auto instances = must(gpu::DeviceArray<gpu::DeviceInstance>::from(two, nullptr, memory));
  const gpu::SceneObjects objects = gpu::separate_objects(record, 1);
  const gpu::BuildSizes top = must(gpu::instance_sizes(objects, 2));
  auto output = bytes(top.output), top_scratch = bytes(top.scratch);
  const auto scene =
      must(gpu::enqueue_instances(objects, {instances.data(), 2}, {}, output.data(), top_scratch.data(), nullptr));
  auto hit = must(gpu::DeviceArray<Hit>::make(1, nullptr, memory));
  must(gpu::launch(trace, gpu::Grid{}, nullptr, {.block = 1}, scene, hit.data()));
  std::printf("t = %g\n", static_cast<double>(must(hit.to_vector(nullptr)).front().t));
}
