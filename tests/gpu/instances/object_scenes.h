#pragma once
/// Objects that the device has built in separate allocations, a scene over them, and the same on the host.

#include <hiprt_build/gpu/objects.h>
#include <tests/gpu/counting_allocator.h>
#include <tests/gpu/instances/trace_instances.h>
#include <tests/gpu/results.h>
#include <tests/traversal/instances/instance_scenes.h>

#include <algorithm>
#include <cstdlib>
#include <optional>

namespace hiprt::checks {

/// Memory of the device that lives as long as the test.
class Memory {
 public:
  std::byte* take(std::uint64_t bytes) {
    buffers_.push_back(must(gpu::DeviceBuffer::make(static_cast<std::size_t>(bytes), nullptr, allocator)));
    must(buffers_.back().fill(std::byte{0xa5}, nullptr));
    return buffers_.back().data();
  }
  template <class T> T* copy(const std::vector<T>& values) {
    if (values.empty()) return nullptr;
    buffers_.push_back(must(gpu::DeviceBuffer::make(values.size() * sizeof(T), nullptr, allocator)));
    must(buffers_.back().upload(std::as_bytes(std::span(values)), nullptr));
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
    return reinterpret_cast<T*>(buffers_.back().data());
  }

  CountingAllocator allocator;

 private:
  std::vector<gpu::DeviceBuffer> buffers_;
};

inline gpu::DeviceGeometry upload(Memory& memory, const oracle::Mesh& mesh) {
  return {.positions = memory.copy(mesh.positions),
          .triangles = memory.copy(mesh.triangles),
          .position_count = static_cast<std::uint32_t>(mesh.positions.size()),
          .primitive_count = static_cast<std::uint32_t>(mesh.triangles.size())};
}

/// Objects 0 and 1 from a build each, 2 from an uploaded file, 3 and 4 from a batch, 5 empty. The host has the same.
class World {
 public:
  explicit World(std::uint64_t random_seed) : seed(random_seed) {
    const oracle::Mesh meshes[] = {oracle::icosphere(1), oracle::soup(60, 0.4, seed), oracle::icosphere(0),
                                   oracle::soup(5, 0.5, seed + 1), oracle::soup(40, 0.5, seed + 2)};
    for (const oracle::Mesh& mesh : meshes) scene.add_file({mesh}, NodeLayout::kPlanes);
    scene.add_file({}, NodeLayout::kPlanes);
    std::vector<gpu::ObjectSource> sources;
    for (unsigned i = 0; i < 2; ++i) sources.push_back(object_of(enqueue(upload(memory, meshes[i]))));
    uploaded_.emplace(must(gpu::upload_scene(scene.files[2].bytes(), nullptr, memory.allocator)));
    sources.push_back(object_of(*uploaded_));
    records = reinterpret_cast<ObjectRecord*>(memory.take((kObjects + 1) * sizeof(ObjectRecord)));
    must(gpu::enqueue_objects(sources, records, nullptr));
    enqueue_batch(meshes[3], meshes[4]);
    const gpu::BuildReport* empty = enqueue(gpu::DeviceGeometry{});
    must(gpu::enqueue_objects({{object_of(empty)}}, records + 5, nullptr));
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
  }

  gpu::SceneObjects objects(std::uint32_t count = kObjects) const { return gpu::separate_objects(records, count); }

  /// A file of the device's scene, checked; it replaces the host's.
  void download(const gpu::InstanceReport* report, const gpu::SceneObjects& of) {
    const auto read = must(gpu::read_report(report, of, nullptr));
    scene.file = must(gpu::download_file(read, of, nullptr));
    const auto summary = validate(std::as_const(scene.file).bytes());
    INFO((summary ? std::string() : to_string(summary.error())));
    REQUIRE(summary.has_value());
  }

  static constexpr std::uint32_t kObjects = 6;
  std::uint64_t seed;
  Memory memory;
  InstanceScene scene;
  ObjectRecord* records = nullptr;

 private:
  const gpu::BuildReport* enqueue(const gpu::DeviceGeometry& geometry) {
    const gpu::BuildSizes sizes = must(gpu::build_sizes({&geometry, 1}));
    return must(gpu::enqueue_build({&geometry, 1}, {}, memory.take(sizes.output), memory.take(sizes.scratch), nullptr));
  }
  void enqueue_batch(const oracle::Mesh& a, const oracle::Mesh& b) {
    oracle::Mesh both = a;
    both.positions.insert(both.positions.end(), b.positions.begin(), b.positions.end());
    for (build::Triangle triangle : b.triangles) {
      for (std::uint32_t& index : triangle) index += static_cast<std::uint32_t>(a.positions.size());
      both.triangles.push_back(triangle);
    }
    const std::vector<std::uint32_t> first{0, static_cast<std::uint32_t>(a.triangles.size()),
                                           static_cast<std::uint32_t>(both.triangles.size())};
    const gpu::DeviceGeometry mesh = upload(memory, both);
    const gpu::DeviceBatch batch{mesh.positions, mesh.triangles, mesh.position_count, first, memory.copy(first)};
    const gpu::BuildSizes sizes = must(gpu::batch_sizes(batch));
    const auto scenes =
        must(gpu::enqueue_batch(batch, {}, memory.take(sizes.output), memory.take(sizes.scratch), nullptr));
    must(gpu::enqueue_objects(scenes.views, 2, records + 3, nullptr));
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
  }

  std::optional<gpu::DeviceScene> uploaded_;
};

inline std::vector<Instance> random_instances(std::size_t count, std::uint32_t objects, std::uint64_t seed) {
  oracle::Random random(seed);
  std::vector<Instance> instances(count);
  for (std::size_t i = 0; i < count; ++i) {
    instances[i].object = random.below(objects);
    instances[i].to_scene = random_affine(random, 5.0);
    instances[i].mask = random.below(6) == 0 ? 2u : 0xffffffffu;
    instances[i].id = static_cast<std::uint32_t>(7 * i);
  }
  return instances;
}

inline std::vector<gpu::DeviceInstance> on_device(const std::vector<Instance>& instances) {
  std::vector<gpu::DeviceInstance> result;
  for (const Instance& instance : instances)
    result.push_back({instance.to_scene, instance.object, instance.mask, instance.id, 0});
  return result;
}

/// The memory of a scene over objects.
struct TopLevel {
  TopLevel(World& in, const gpu::SceneObjects& of, std::uint32_t instances, std::uint32_t keys = 0)
      : world(in),
        objects(of),
        count(instances),
        sizes(must(gpu::instance_sizes(of, instances, {}, keys))),
        output(in.memory.take(sizes.output)),
        scratch(in.memory.take(sizes.scratch)) {}

  const gpu::InstanceReport* run(const std::vector<Instance>& instances, const gpu::DeviceMotions& motions = {},
                                 bool update = false) {
    const gpu::DeviceInstances from{world.memory.copy(on_device(instances)), count, motions};
    const auto enqueue = update ? gpu::enqueue_update : gpu::enqueue_instances;
    const gpu::InstanceReport* report = must(enqueue(objects, from, {}, output, scratch, nullptr));
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
    return report;
  }

  World& world;
  gpu::SceneObjects objects;
  std::uint32_t count;
  gpu::BuildSizes sizes;
  std::byte *output, *scratch;
};

/// Translating the tracer for amdrun takes a minute: tools/check leaves that to --all.
inline bool traces_on_device() {
#if defined(HIPRT_QUICK_TESTS)
  return std::getenv("HIPRT_EMULATED_CASES") == nullptr;
#else
  return true;
#endif
}

/// The device's hits are the host's in the downloaded file.
inline void check_device_hits(World& world, const gpu::InstanceReport* report, float begin = 0, float end = 0) {
  oracle::Random random(world.seed);
  std::vector<Ray> rays(200);
  for (Ray& ray : rays) {
    ray = random_ray(random, 6.0);
    ray.time = static_cast<float>(random.uniform(begin, end));
  }
  const auto device = must(trace_instances(report, rays, MemoryOfStacks::kThread, nullptr, world.memory.allocator));
  CHECK(device == trace_instances(world.scene.view(), rays));
  CHECK(std::count_if(device.begin(), device.end(), [](const auto& hit) { return hit.primitive != kInvalidId; }) > 10);
}

}  // namespace hiprt::checks
