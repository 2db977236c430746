// Instances of objects that the device has built, each in memory of its own: batches, groups, updates and motion. The
// downloaded files are validated, and their hits compared with a loop over all instances.

#include <hiprt_build/gpu/objects.h>
#include <hiprt_build/instances/gpu_motion.h>
#include <hiprt_build/instances/make_instance.h>
#include <hiprt_build/instances/motion_segments.h>
#include <tests/gpu/counting_allocator.h>
#include <tests/gpu/results.h>
#include <tests/gpu/trace_instances.h>
#include <tests/traversal/instance_scenes.h>

#include <algorithm>
#include <cstdlib>
#include <optional>

using namespace hiprt;
using namespace hiprt::checks;
using build::MatrixKey;
using build::MotionKey;
using Catch::Matchers::Contains;
using gpu::DeviceInstance;
using gpu::KeyRange;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261127;

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

gpu::DeviceGeometry upload(Memory& memory, const oracle::Mesh& mesh) {
  return {.positions = memory.copy(mesh.positions),
          .triangles = memory.copy(mesh.triangles),
          .position_count = static_cast<std::uint32_t>(mesh.positions.size()),
          .primitive_count = static_cast<std::uint32_t>(mesh.triangles.size())};
}

/// Objects 0 and 1 from a build each, 2 from an uploaded file, 3 and 4 from a batch, 5 empty. The host has the same.
class World {
 public:
  World() {
    const oracle::Mesh meshes[] = {oracle::icosphere(1), oracle::soup(60, 0.4, kSeed), oracle::icosphere(0),
                                   oracle::soup(5, 0.5, kSeed + 1), oracle::soup(40, 0.5, kSeed + 2)};
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

std::vector<Instance> random_instances(std::size_t count, std::uint32_t objects, std::uint64_t seed) {
  Random random(seed);
  std::vector<Instance> instances(count);
  for (std::size_t i = 0; i < count; ++i) {
    instances[i].object = random.below(objects);
    instances[i].to_scene = random_affine(random, 5.0);
    instances[i].mask = random.below(6) == 0 ? 2u : 0xffffffffu;
    instances[i].id = static_cast<std::uint32_t>(7 * i);
  }
  return instances;
}

std::vector<DeviceInstance> on_device(const std::vector<Instance>& instances) {
  std::vector<DeviceInstance> result;
  for (const Instance& instance : instances)
    result.push_back({instance.to_scene, instance.object, instance.mask, instance.id, 0});
  return result;
}

/// A scene over objects, in memory of its own.
struct Top {
  Top(World& in, const gpu::SceneObjects& of, std::uint32_t instances, std::uint32_t keys = 0)
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
bool traces_on_device() {
#if defined(HIPRT_QUICK_TESTS)
  return std::getenv("HIPRT_EMULATED_CASES") == nullptr;
#else
  return true;
#endif
}

/// The device's hits are the host's in the downloaded file.
void check_device_hits(World& world, const gpu::InstanceReport* report, float begin = 0, float end = 0) {
  Random random(kSeed);
  std::vector<Ray> rays(200);
  for (Ray& ray : rays) {
    ray = random_ray(random, 6.0);
    ray.time = static_cast<float>(random.uniform(begin, end));
  }
  const auto device = must(trace_instances(report, rays, MemoryOfStacks::kThread, nullptr, world.memory.allocator));
  CHECK(device == trace_instances(world.scene.view(), rays));
  CHECK(std::count_if(device.begin(), device.end(), [](const auto& hit) { return hit.primitive != kInvalidId; }) > 10);
}

}  // namespace

TEST_CASE("instances of separately built objects") {
  INFO("seed " << kSeed);
  World world;
  constexpr std::uint32_t kCount = 150;
  Top top(world, world.objects(), kCount);
  world.scene.groups.push_back(random_instances(kCount, World::kObjects, kSeed));
  const unsigned before = world.memory.allocator.calls;
  const gpu::InstanceReport* report = top.run(world.scene.groups[0]);
  CHECK(world.memory.allocator.calls == before + 1);  // Of this test's own, for the instances.
  world.download(report, top.objects);
  check_rays<Instanced<Policies, 1>>(world.scene, kSeed, 300);
  if (traces_on_device()) check_device_hits(world, report);
}

TEST_CASE("instances of groups that the device has built") {
  INFO("seed " << kSeed);
  World world;
  Top group(world, world.objects(), 8);
  world.scene.groups.push_back(random_instances(8, World::kObjects, kSeed + 5));
  const gpu::InstanceReport* inner = group.run(world.scene.groups[0]);
  must(gpu::enqueue_objects({{gpu::object_of(inner)}}, world.records + World::kObjects, nullptr));
  Top top(world, world.objects(World::kObjects + 1), 60);
  world.scene.groups.push_back(random_instances(60, World::kObjects + 1, kSeed + 6));
  const gpu::InstanceReport* report = top.run(world.scene.groups[1]);
  world.download(report, top.objects);
  CHECK(world.scene.view().levels == 2);
  check_rays<Instanced<Policies, 2>>(world.scene, kSeed, 300);
  if (traces_on_device()) check_device_hits(world, report);
}

namespace {

/// A scene over a batch's scenes, downloaded.
const gpu::InstanceReport* over_batch(World& world, const gpu::BatchScenes& scenes,
                                      const std::vector<Instance>& instances) {
  auto* records = reinterpret_cast<ObjectRecord*>(world.memory.take(scenes.count * sizeof(ObjectRecord)));
  must(gpu::enqueue_objects(scenes.views, scenes.count, records, nullptr));
  Top top(world, gpu::separate_objects(records, scenes.count), static_cast<std::uint32_t>(instances.size()));
  const gpu::InstanceReport* report = top.run(instances);
  world.download(report, top.objects);
  return report;
}

}  // namespace

TEST_CASE("instances of a batch of geometries with arrays of their own, and of a compact one") {
  INFO("seed " << kSeed);
  World world;
  InstanceScene& scene = world.scene;
  scene.files.clear();
  std::vector<gpu::DeviceGeometry> geometries;
  for (const unsigned count : {5u, 40u, 0u, 300u, 100u, 1u}) {
    oracle::Mesh mesh = oracle::soup(std::max(count, 1u), 0.5, kSeed + count);
    if (count == 0) mesh = {};
    geometries.push_back(upload(world.memory, mesh));
    if (count == 100) {  // Positions without indices.
      geometries.back().triangles = nullptr;
      geometries.back().implicit_triangles = true;
      geometries.back().mask = 3;
      mesh.mask = 3;
    }
    scene.add_file({mesh}, NodeLayout::kPlanes);
  }
  // The same arrays once more.
  geometries.push_back(geometries[1]);
  scene.add_file({oracle::soup(40, 0.5, kSeed + 40)}, NodeLayout::kPlanes);
  const gpu::GeometryBatch batch{geometries, world.memory.copy(geometries)};
  const gpu::BuildSizes sizes = must(gpu::batch_sizes(batch));
  std::byte* output = world.memory.take(sizes.output);
  const auto scenes = must(gpu::enqueue_batch(batch, {}, output, world.memory.take(sizes.scratch), nullptr));
  CHECK(scenes.count == 7);
  scene.groups.push_back(random_instances(80, scenes.count, kSeed));
  const gpu::InstanceReport* report = over_batch(world, scenes, scene.groups[0]);
  check_rays<Instanced<Policies, 1>>(scene, kSeed, 300);
  if (traces_on_device()) check_device_hits(world, report);
  const auto compact = must(gpu::compact_batch(scenes, nullptr, world.memory.allocator));
  CHECK(compact.buffer.size() < sizes.output);
  REQUIRE(hipMemset(output, 0xa5, static_cast<std::size_t>(sizes.output)) == hipSuccess);
  report = over_batch(world, compact.scenes, scene.groups[0]);
  check_rays<Instanced<Policies, 1>>(scene, kSeed, 300);
  if (traces_on_device()) check_device_hits(world, report);
}

TEST_CASE("a batch of boxes and meshes") {
  World world;
  Random random(kSeed);
  std::vector<Box> boxes;
  for (unsigned i = 0; i < 50; ++i) {
    const auto p = random.in_cube(4);
    boxes.push_back({{p[0], p[1], p[2]}, {p[0] + 1, p[1] + 1, p[2] + 1}});
  }
  std::vector<gpu::DeviceGeometry> geometries{upload(world.memory, oracle::soup(20, 0.5, kSeed))};
  for (const std::uint32_t count : {1u, 50u})
    geometries.push_back({.boxes = world.memory.copy(boxes), .primitive_count = count, .type = 1000 + count});
  const gpu::GeometryBatch batch{geometries, world.memory.copy(geometries)};
  const gpu::BuildSizes sizes = must(gpu::batch_sizes(batch));
  const auto scenes =
      must(gpu::enqueue_batch(batch, {}, world.memory.take(sizes.output), world.memory.take(sizes.scratch), nullptr));
  over_batch(world, scenes, random_instances(30, 3, kSeed));
  const SceneView view = world.scene.view();
  for (unsigned i = 0; i < 3; ++i) {
    const auto& record =
        *reinterpret_cast<const GeometryRecord*>(view.base + view.objects[i].offset + view.objects[i].geometries);
    CHECK(record.primitive_count == geometries[i].primitive_count);
    CHECK(geometry_type(record.flags) == geometries[i].type);
    CHECK(view.objects[i].features == feature_bit(i == 0 ? Feature::kTriangles : Feature::kCustom));
  }
  geometries[0].position_stride = 10;
  CHECK(error_of(gpu::batch_sizes(gpu::GeometryBatch{geometries, nullptr})).message ==
        "batch: device_geometries must not be nullptr");
  CHECK(error_of(gpu::batch_sizes(gpu::GeometryBatch{geometries, batch.device_geometries})).message ==
        "geometry 0: position_stride of 10 bytes; it must be a multiple of 4, at least 12");
}

TEST_CASE("an update has the hits of a build") {
  INFO("seed " << kSeed);
  World world;
  constexpr std::uint32_t kCount = 120;
  Top top(world, world.objects(), kCount);
  std::vector<Instance> instances = random_instances(kCount, World::kObjects, kSeed);
  const gpu::InstanceReport* report = top.run(instances);
  Random random(kSeed + 9);
  for (Instance& instance : instances) {
    instance.to_scene = random_affine(random, 5.0);
    instance.mask = random.below(4) == 0 ? 1u : 0xffffffffu;
    if (instance.object < 5) instance.object = random.below(5);
  }
  CHECK(top.run(instances, {}, true) == report);
  world.scene.groups.push_back(instances);
  world.download(report, top.objects);
  check_rays<Instanced<Policies, 1>>(world.scene, kSeed, 300);
  if (traces_on_device()) check_device_hits(world, report);
  // Object 5 is empty: its instances have no leaf.
  const auto empty = std::find_if(instances.begin(), instances.end(), [](const Instance& i) { return i.object == 5; });
  REQUIRE(empty != instances.end());
  empty->object = 0;
  const auto error = error_of(gpu::read_report(top.run(instances, {}, true), top.objects, nullptr));
  CHECK(error.message == "instance " + std::to_string(empty - instances.begin()) +
                             ": it was empty when the tree was built, and is not now; build the tree again");
  CHECK(gpu::read_report(top.run(instances), top.objects, nullptr).has_value());
}

TEST_CASE("motions on the device: valid bounds, and the hits of a loop over all instances") {
  INFO("seed " << kSeed);
  World world;
  Random random(kSeed);
  constexpr std::uint32_t kCount = 60;
  std::vector<build::Motion> motions(kCount);
  std::vector<MotionKey> keys;
  std::vector<MatrixKey> matrices;
  std::vector<KeyRange> ranges(kCount);
  const MotionKind kind = GENERATE(MotionKind::kSlerp, MotionKind::kNlerp, MotionKind::kMatrix);
  std::vector<Instance> instances = random_instances(kCount, World::kObjects, kSeed);
  for (std::uint32_t i = 0; i < kCount; ++i) {
    if (i % 5 == 0) continue;  // Stands still.
    ranges[i] = {static_cast<std::uint32_t>(keys.size()), 1 + random.below(3)};
    float time = static_cast<float>(random.uniform(-1, 0));
    for (std::uint32_t k = 0; k < ranges[i].count; ++k) {
      const auto axis = random.on_sphere();
      const double angle = kind == MotionKind::kMatrix ? 0.3 * k : random.uniform(0, 1.5);
      MotionKey key{.time = time += static_cast<float>(random.uniform(0.2, 1))};
      for (unsigned a = 0; a < 3; ++a) {
        key.translation[a] = static_cast<float>(random.uniform(-4, 4));
        key.rotation[a] =
            static_cast<float>((kind == MotionKind::kMatrix ? (a == 2 ? 1.0 : 0.0) : axis[a]) * std::sin(angle));
        key.scale[a] = static_cast<float>(random.uniform(0.5, 1.5));
        key.shear[a] = a == 1 ? 0.2f : 0.0f;
      }
      key.rotation[3] = static_cast<float>(std::cos(angle));
      keys.push_back(key);
      matrices.push_back(build::compose(key));
    }
    motions[i].kind = kind;
    motions[i].matrices.assign(matrices.end() - ranges[i].count, matrices.end());
    instances[i].motion = &motions[i];
  }
  const auto key_count = static_cast<std::uint32_t>(keys.size());
  Top top(world, world.objects(), kCount, key_count);
  gpu::DeviceMotions on_device{world.memory.copy(ranges), nullptr, world.memory.copy(matrices), key_count, kind};
  const gpu::InstanceReport* report = top.run(instances, on_device);
  world.scene.groups.push_back(instances);
  world.download(report, top.objects);
  using Tracer = Moving<Instanced<Policies, 1>>;
  check_rays<Tracer>(world.scene, kSeed, 300);
  if (traces_on_device()) check_device_hits(world, report, -1, 3);
  const auto device = trace_instances(world.scene.view(), {});
  // The same scene by the host: the same transforms at all times, so the same hits.
  const build::Buffer downloaded = std::move(world.scene.file);
  world.scene.build();
  const SceneView a = make_scene_view(*open_buffer(downloaded.bytes())), b = world.scene.view();
  for (unsigned i = 0; i < 300; ++i) {
    Ray ray = random_ray(random, 6.0);
    ray.time = static_cast<float>(random.uniform(-1, 3));
    const auto one = closest_hit<Tracer>(a, ray), other = closest_hit<Tracer>(b, ray);
    INFO("ray " << i);
    REQUIRE(one.t == other.t);
    REQUIRE(one.primitive == other.primitive);
    REQUIRE(one.path == other.path);
  }
  if (kind == MotionKind::kMatrix) return;
  // Keys in parts instead of matrices.
  on_device.keys = world.memory.copy(keys);
  on_device.matrices = nullptr;
  world.download(top.run(instances, on_device), top.objects);
  check_rays<Tracer>(world.scene, kSeed, 200);
}

TEST_CASE("segments and swept boxes of the device's text are the host's") {
  INFO("seed " << kSeed);
  Random random(kSeed);
  for (const MotionKind kind : {MotionKind::kSlerp, MotionKind::kNlerp, MotionKind::kMatrix}) {
    for (unsigned run = 0; run < 40; ++run) {
      INFO("kind " << static_cast<unsigned>(kind) << ", run " << run);
      std::vector<MatrixKey> keys;
      for (unsigned k = 0; k < 4; ++k) {
        const Affine to_scene = kind == MotionKind::kMatrix
                                    ? affine({0, 0, 1}, 0.3 * k, {1, 2, 1}, {1.0 * k, 0, 0})
                                    : affine(random.on_sphere(), 2.5 * k, {1, 2, 1}, {1.0 * k, 0, 0});
        keys.push_back({static_cast<float>(k), to_scene});
      }
      const build::Motion motion{.kind = kind, .matrices = keys};
      const auto host = must(build::make_motion(motion));
      const KeyRange range{0, 4};
      const gpu::DeviceMotions from{&range, nullptr, keys.data(), 4, kind};
      std::vector<MotionSegment> segments(3);
      const build::MadeMotion made = build::make_motion(
          build::InstanceKeys{from, range}, [&](std::uint32_t i, const MotionSegment& s) { segments[i] = s; });
      REQUIRE(made.fault == build::MotionFault::kNone);
      CHECK(made.magnification.condition == host.magnification.condition);
      const auto position = random.in_cube(2);
      const Box box{{position[0], position[1], position[2]}, {position[0] + 1, position[1] + 2, position[2] + 1}};
      InstanceRecord record = build::make_instance(host.first.to_scene.row).record;
      const Box swept = build::SweptBounds{segments.data(), 3, kind}.bounds(box),
                expected = format_detail::InstanceMotionBounds(record, host.segments, kind).bounds(box);
      for (unsigned axis = 0; axis < 3; ++axis) {
        CHECK(swept.min[axis] == expected.min[axis]);
        CHECK(swept.max[axis] == expected.max[axis]);
      }
    }
  }
}

TEST_CASE("invalid motions and objects are refused with their numbers") {
  World world;
  const std::vector<Instance> instances(3, Instance{.object = 0});
  const std::vector<KeyRange> ranges{{0, 0}, {0, 0}, {1, 3}};
  const std::vector<MotionKey> good{{}, {.time = 0}, {.time = 1}, {.time = 2}};
  Top top(world, world.objects(), 3, 4);
  const auto refused = [&](const auto& spoil, MotionKind kind = MotionKind::kSlerp) {
    std::vector<MotionKey> keys = good;
    std::vector<KeyRange> of = ranges;
    spoil(keys, of);
    const gpu::DeviceMotions motions{world.memory.copy(of), world.memory.copy(keys), nullptr, 4, kind};
    return error_of(gpu::read_report(top.run(instances, motions), top.objects, nullptr)).message;
  };
  CHECK(refused([](auto& keys, auto&) { keys[3].rotation[3] = 0; }) == "instance 2: key 2: the rotation has length 0");
  CHECK(refused([](auto& keys, auto&) { keys[2].scale[1] = 0; }) == "instance 2: key 1: the scale has a 0");
  CHECK_THAT(refused([](auto& keys, auto&) { keys[3].scale[0] = -1; }), Contains("key 2: the scale changes its sign"));
  CHECK_THAT(refused([](auto& keys, auto&) { keys[2].time = 0; }), Contains("instance 2: key 1: its time is not"));
  CHECK(refused([](auto&, auto& of) { of[2].count = 4; }) == "instance 2: its keys are not all there");
  CHECK_THAT(refused([](auto& keys, auto&) { keys[1].translation[0] = std::numeric_limits<float>::infinity(); }),
             Contains("key 0: a number is not finite"));
  // Half a turn as a matrix passes through 0.
  CHECK_THAT(refused(
                 [](auto& keys, auto&) {
                   keys[2].rotation[2] = 1;
                   keys[2].rotation[3] = 0;
                 },
                 MotionKind::kMatrix),
             Contains("instance 2: between keys 0 and 1 the transform has no inverse"));
  const auto message = [&](const gpu::DeviceMotions& motions) {
    return error_of(gpu::enqueue_instances(top.objects, {world.memory.copy(on_device(instances)), 3, motions}, {},
                                           top.output, top.scratch, nullptr))
        .message;
  };
  CHECK(message({.key_count = 4}) ==
        "enqueue_instances: motions need ranges, a key_count, and either keys or matrices");
  gpu::SceneObjects wide = world.objects();
  wide.layout = NodeLayout::kHalf;
  Top other(world, wide, 3);
  CHECK(error_of(gpu::read_report(other.run(instances), wide, nullptr)).message ==
        "instance 0: object 0 has another node layout than the scene's objects");
}
