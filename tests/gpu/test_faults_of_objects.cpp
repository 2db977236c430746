// Each call of the GPU runtime that fails: builds in steps, objects and instances of them, motions, batches of
// geometries, qualities, replicas and timers.

#include <hiprt_build/gpu/batch.h>
#include <hiprt_build/gpu/build_steps.h>
#include <hiprt_build/gpu/device.h>
#include <hiprt_build/gpu/event.h>
#include <hiprt_build/gpu/objects.h>
#include <hiprt_build/gpu/refit.h>
#include <hiprt_build/gpu/replicate.h>
#include <tests/gpu/every_call.h>
#include <tests/oracle/odd_meshes.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint32_t kInstances = 12;

gpu::Result<Bytes> read(const gpu::DeviceBuffer& buffer) {
  Bytes bytes(buffer.size());
  if (auto done = buffer.download(bytes, nullptr); !done) return tl::unexpected(done.error());
  if (auto done = gpu::check(hipStreamSynchronize(nullptr), "hipStreamSynchronize"); !done)
    return tl::unexpected(done.error());
  return bytes;
}

void check_steps(const gpu::BuildOptions& options) {
  Input input({oracle::star(2, kSeed), oracle::torus(12, 10, 0.3)});
  check_every_call(
      "BuildSteps, " + std::string(build::name(options.builder)), [&](Allocation& allocator) -> gpu::Result<Bytes> {
        auto steps = gpu::BuildSteps::make(input.geometries, options);
        if (!steps) return tl::unexpected(steps.error());
        gpu::DeviceBuffer scene;
        while (!steps->done()) {
          auto memory = Memory::make(steps->sizes(), allocator);
          if (!memory) return tl::unexpected(memory.error());
          auto done = steps->enqueue(memory->output.data(), memory->scratch.data(), nullptr);
          if (done) done = steps->wait();
          if (!done) {
            // No later step may begin.
            CHECK_FALSE(steps->done());
            CHECK_FALSE(steps->enqueue(memory->output.data(), memory->scratch.data(), nullptr).has_value());
            return tl::unexpected(done.error());
          }
          scene = std::move(memory->output);
        }
        return read(scene);
      });
}

/// A top level over objects that @p add_records has enqueued, as a file.
template <class AddRecords>
gpu::Result<Bytes> build_over(std::uint32_t objects, const gpu::DeviceInstances& instances, Allocation& allocator,
                              const AddRecords& add_records) {
  auto records = gpu::DeviceArray<ObjectRecord>::make(objects, nullptr, allocator);
  if (!records) return tl::unexpected(records.error());
  if (auto added = add_records(records->data()); !added) return tl::unexpected(added.error());
  gpu::SceneObjects of = gpu::separate_objects(records->data(), objects);
  of.shutter_rate = 1.0f;
  auto memory = Memory::make(gpu::instance_sizes(of, instances.count, {}, instances.motions.key_count), allocator);
  if (!memory) return tl::unexpected(memory.error());
  const auto report = gpu::enqueue_instances(of, instances, {}, memory->output.data(), memory->scratch.data(), nullptr);
  if (!report) return tl::unexpected(report.error());
  const auto done = gpu::read_report(*report, of, nullptr);
  if (!done) return tl::unexpected(done.error());
  return as_bytes(gpu::download_file(*done, of, nullptr));
}

/// Instances in a row, of objects in turn.
std::vector<gpu::DeviceInstance> in_a_row(std::uint32_t objects) {
  std::vector<gpu::DeviceInstance> instances(kInstances);
  for (std::uint32_t i = 0; i < kInstances; ++i) {
    instances[i].object = i % objects;
    instances[i].to_scene.row[0][3] = 3 * static_cast<float>(i);
  }
  return instances;
}

/// Small and large geometries. The largest one is built by itself.
struct Geometries {
  CountingAllocator memory;
  Input input{{oracle::star(1, kSeed), oracle::soup(40, 0.5, kSeed), oracle::torus(20, 16, 0.3)}};
  gpu::DeviceArray<gpu::DeviceGeometry> on_device =
      must(gpu::DeviceArray<gpu::DeviceGeometry>::from(input.geometries, nullptr, memory));

  gpu::GeometryBatch batch() const { return {input.geometries, on_device.data()}; }
};

}  // namespace

TEST_CASE("builds in steps") { check_steps({.builder = build::Builder::kHploc}); }

TEST_CASE("other builds in steps") {
  check_steps({.builder = build::Builder::kSbvh, .presplit_budget = 1.3, .reinsertion_rounds = 1});
}

TEST_CASE("batches of geometries") {
  const Geometries of;
  REQUIRE(of.input.geometries[2].primitive_count > gpu::kBatchTriangles);
  check_every_call("batch of geometries", [&](Allocation& allocator) -> gpu::Result<Bytes> {
    auto memory = Memory::make(gpu::batch_sizes(of.batch()), allocator);
    if (!memory) return tl::unexpected(memory.error());
    const auto scenes = gpu::enqueue_batch(of.batch(), {}, memory->output.data(), memory->scratch.data(), nullptr);
    if (!scenes) return tl::unexpected(scenes.error());
    const auto compact = gpu::compact_batch(*scenes, nullptr, allocator);
    if (!compact) return tl::unexpected(compact.error());
    Bytes all;
    for (std::uint32_t i = 0; i < 3; ++i) {
      const auto file = gpu::download_file(compact->scenes, i, nullptr, allocator);
      if (!file) return tl::unexpected(file.error());
      const Bytes bytes = bytes_of(*file);
      all.insert(all.end(), bytes.begin(), bytes.end());
    }
    return all;
  });
}

TEST_CASE("objects of separate builds, and of a batch") {
  Geometries of;
  CountingAllocator outside;
  const auto first = must(gpu::build_scene({of.input.geometries.data(), 1}, {}, nullptr, outside)),
             second = must(gpu::build_scene({of.input.geometries.data() + 1, 1}, {}, nullptr, outside));
  const auto row = in_a_row(2), of_three = in_a_row(3);
  const auto on_device = must(gpu::DeviceArray<gpu::DeviceInstance>::from(row, nullptr, outside));
  const auto three_on_device = must(gpu::DeviceArray<gpu::DeviceInstance>::from(of_three, nullptr, outside));
  check_every_call("objects", [&](Allocation& allocator) {
    const gpu::ObjectSource sources[] = {gpu::object_of(first), gpu::object_of(second)};
    return build_over(2, {on_device.data(), kInstances}, allocator,
                      [&](ObjectRecord* records) { return gpu::enqueue_objects(sources, records, nullptr); });
  });
  auto memory = must(Memory::make(gpu::batch_sizes(of.batch()), outside));
  const auto scenes = must(gpu::enqueue_batch(of.batch(), {}, memory.output.data(), memory.scratch.data(), nullptr));
  check_every_call("objects of a batch", [&](Allocation& allocator) {
    return build_over(3, {three_on_device.data(), kInstances}, allocator, [&](ObjectRecord* records) {
      return gpu::enqueue_objects(scenes.views, scenes.count, records, nullptr);
    });
  });
}

TEST_CASE("instances that move") {
  Input input({oracle::star(1, kSeed)});
  CountingAllocator outside;
  const auto scene = must(gpu::build_scene(input.geometries, {}, nullptr, outside));
  const auto instances = must(gpu::DeviceArray<gpu::DeviceInstance>::from(in_a_row(1), nullptr, outside));
  const std::vector<build::MotionKey> keys{{.time = 0},
                                           {.time = 1, .translation = {0, 5, 0}, .rotation = {0, 0, 1, 1}}};
  std::vector<gpu::KeyRange> ranges(kInstances);
  for (std::uint32_t i = 0; i < kInstances; i += 2) ranges[i] = {0, 2};
  const auto device_keys = must(gpu::DeviceArray<build::MotionKey>::from(keys, nullptr, outside));
  const auto device_ranges = must(gpu::DeviceArray<gpu::KeyRange>::from(ranges, nullptr, outside));
  const gpu::DeviceMotions motions{device_ranges.data(), device_keys.data(), nullptr, 2, MotionKind::kSlerp};
  check_every_call("motions", [&](Allocation& allocator) {
    const gpu::ObjectSource sources[] = {gpu::object_of(scene)};
    return build_over(1, {instances.data(), kInstances, motions}, allocator,
                      [&](ObjectRecord* records) { return gpu::enqueue_objects(sources, records, nullptr); });
  });
}

TEST_CASE("qualities of scenes") {
  Input input({oracle::star(2, kSeed)});
  CountingAllocator outside;
  gpu::BuiltScene scene = must(gpu::build_scene(input.geometries, {}, nullptr, outside));
  const gpu::SceneParts parts = gpu::parts_of(scene);
  check_every_call("quality", [&](Allocation& allocator) -> gpu::Result<Bytes> {
    auto scratch = gpu::DeviceBuffer::make(gpu::refit_scratch(parts), nullptr, allocator);
    if (!scratch) return tl::unexpected(scratch.error());
    const auto report = gpu::enqueue_quality(parts, scratch->data(), nullptr);
    if (!report) return tl::unexpected(report.error());
    Bytes costs(2 * sizeof(double));
    const auto offset = reinterpret_cast<const std::byte*>(&(*report)->sah_cost) - scratch->data();
    static_assert(offsetof(gpu::RefitReport, exchange_slack) == offsetof(gpu::RefitReport, sah_cost) + sizeof(double));
    if (auto done = scratch->download(costs, nullptr, static_cast<std::size_t>(offset)); !done)
      return tl::unexpected(done.error());
    if (auto done = gpu::check(hipStreamSynchronize(nullptr), "hipStreamSynchronize"); !done)
      return tl::unexpected(done.error());
    return costs;
  });
}

TEST_CASE("replicas of scenes") {
  Input input({oracle::star(1, kSeed)});
  CountingAllocator outside;
  const gpu::BuiltScene scene = must(gpu::build_scene(input.geometries, {}, nullptr, outside));
  check_every_call("replicate", [&](Allocation& allocator) -> gpu::Result<Bytes> {
    const int devices[] = {0, 0, 0};
    const auto replicas = gpu::replicate(scene, 0, devices, allocator);
    if (!replicas) return tl::unexpected(replicas.error());
    return read(replicas->back().scene.buffer);
  });
}

TEST_CASE("timers of streams, and questions about devices") {
  check_every_call("StreamTimer", [&](Allocation&) -> gpu::Result<Bytes> {
    auto timer = gpu::StreamTimer::make();
    if (!timer) return tl::unexpected(timer.error());
    auto done = timer->start(nullptr);
    if (done) done = timer->stop(nullptr);
    if (!done) return tl::unexpected(done.error());
    const auto milliseconds = timer->milliseconds();
    if (!milliseconds) return tl::unexpected(milliseconds.error());
    return Bytes(1, *milliseconds >= 0 ? std::byte{1} : std::byte{0});
  });
  check_every_call("devices", [&](Allocation&) -> gpu::Result<Bytes> {
    const auto devices = gpu::devices();
    if (!devices) return tl::unexpected(devices.error());
    const auto current = gpu::current_device();
    if (!current) return tl::unexpected(current.error());
    return Bytes(devices->size(), static_cast<std::byte>(current->index));
  });
}
