// Instances of objects that the device has built in separate allocations: batches, groups and updates. The downloaded
// files are validated, and their hits compared with a loop over all instances.

#include <tests/gpu/instances/object_scenes.h>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261127;

}  // namespace

TEST_CASE("instances of separately built objects") {
  INFO("seed " << kSeed);
  World world(kSeed);
  constexpr std::uint32_t kCount = 150;
  TopLevel top(world, world.objects(), kCount);
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
  World world(kSeed);
  TopLevel group(world, world.objects(), 8);
  world.scene.groups.push_back(random_instances(8, World::kObjects, kSeed + 5));
  const gpu::InstanceReport* inner = group.run(world.scene.groups[0]);
  must(gpu::enqueue_objects({{gpu::object_of(inner)}}, world.records + World::kObjects, nullptr));
  TopLevel top(world, world.objects(World::kObjects + 1), 60);
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
  TopLevel top(world, gpu::separate_objects(records, scenes.count), static_cast<std::uint32_t>(instances.size()));
  const gpu::InstanceReport* report = top.run(instances);
  world.download(report, top.objects);
  return report;
}

}  // namespace

TEST_CASE("instances of a batch of geometries with arrays of their own, and of a compact one") {
  INFO("seed " << kSeed);
  World world(kSeed);
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

TEST_CASE("scenes of a batch as files") {
  World world(kSeed);
  world.scene.files.clear();
  std::vector<gpu::DeviceGeometry> geometries;
  std::vector<oracle::Mesh> meshes;
  for (const unsigned count : {5u, 40u, 1u, 300u}) {
    meshes.push_back(oracle::soup(count, 0.5, kSeed + count));
    meshes.back().mask = count;
    geometries.push_back(upload(world.memory, meshes.back()));
    geometries.back().mask = count;
    world.scene.add_file({meshes.back()}, NodeLayout::kPlanes);
  }
  geometries.push_back(upload(world.memory, {}));
  const gpu::GeometryBatch batch{geometries, world.memory.copy(geometries)};
  const gpu::BuildSizes sizes = must(gpu::batch_sizes(batch));
  const auto scenes =
      must(gpu::enqueue_batch(batch, {}, world.memory.take(sizes.output), world.memory.take(sizes.scratch), nullptr));
  const auto compact = must(gpu::compact_batch(scenes, nullptr, world.memory.allocator));
  for (const gpu::BatchScenes& from : {scenes, compact.scenes}) {
    for (std::uint32_t i = 0; i < scenes.count; ++i) {
      CAPTURE(i);
      const build::Buffer file = must(gpu::download_file(from, i, nullptr, world.memory.allocator));
      const auto summary = validate(file.bytes());
      INFO((summary ? std::string() : to_string(summary.error())));
      REQUIRE(summary.has_value());
      const auto view = open_buffer(file.bytes());
      if (i == meshes.size()) {
        CHECK(view->geometries.empty());
        continue;
      }
      REQUIRE(view->geometries.size() == 1);
      CHECK(view->geometries[0].primitive_count == geometries[i].primitive_count);
      CHECK(view->geometries[0].mask == geometries[i].mask);
      const SceneView scene = make_scene_view(*view);
      const SceneView same = make_scene_view(*open_buffer(std::as_const(world.scene.files[i]).bytes()));
      Random random(kSeed);
      for (unsigned k = 0; k < 200; ++k) {
        const Ray ray = random_ray(random, 2.0);
        const Hit a = closest_hit<Policies>(scene, ray), b = closest_hit<Policies>(same, ray);
        REQUIRE(a.primitive == b.primitive);
        REQUIRE(a.t == b.t);
      }
    }
  }
  CHECK(error_of(gpu::download_file(scenes, 5, nullptr, world.memory.allocator)).message ==
        "download_file: scene 5, the batch has 5");
}

TEST_CASE("objects with equal records are one in the file") {
  World world(kSeed);
  auto* const twice = reinterpret_cast<ObjectRecord*>(world.memory.take(2 * World::kObjects * sizeof(ObjectRecord)));
  for (const std::uint32_t first : {0u, World::kObjects})
    REQUIRE(hipMemcpy(twice + first, world.records, World::kObjects * sizeof(ObjectRecord), hipMemcpyDeviceToDevice) ==
            hipSuccess);
  TopLevel top(world, gpu::separate_objects(twice, 2 * World::kObjects), 60);
  std::vector<Instance> instances = random_instances(60, 2 * World::kObjects, kSeed);
  world.download(top.run(instances), top.objects);
  CHECK(open_buffer(std::as_const(world.scene.file).bytes())->objects.size() == World::kObjects);
  for (Instance& instance : instances) instance.object %= World::kObjects;
  world.scene.groups.push_back(instances);
  check_rays<Instanced<Policies, 1>>(world.scene, kSeed, 300);
}

TEST_CASE("a batch of boxes and meshes") {
  World world(kSeed);
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
  World world(kSeed);
  constexpr std::uint32_t kCount = 120;
  TopLevel top(world, world.objects(), kCount);
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
