// Top-level trees built on the device: records, boxes and hits equal the host's, bit for bit.

#include <hiprt_build/format/view.h>
#include <tests/gpu/counting_allocator.h>
#include <tests/gpu/instances/trace_instances.h>
#include <tests/gpu/results.h>
#include <tests/traversal/instances/instance_scenes.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>

using namespace hiprt;
using namespace hiprt::checks;
using build::InstanceBounds;
using gpu::DeviceInstance;
using gpu::InstanceStatus;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261123;

/// Two files, one of them empty, and a group over the other: objects 0 to 2.
InstanceScene small_objects(NodeLayout layout) {
  InstanceScene scene;
  Random random(kSeed);
  scene.add_file({oracle::icosphere(2), oracle::soup(20, 0.5, kSeed)}, layout);
  scene.add_file({}, layout);
  scene.groups.emplace_back(5);
  for (Instance& instance : scene.groups[0]) instance.to_scene = random_affine(random, 1.0);
  return scene;
}

/// Instances of all objects.
std::vector<Instance> random_instances(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Instance> instances(count);
  for (std::size_t i = 0; i < count; ++i)
    instances[i] = {.object = random.below(8) == 0 ? 1 : 2 * random.below(2),
                    .to_scene = random_affine(random, 5.0),
                    .mask = random.below(6) == 0 ? 2u : 0xffffffffu,
                    .id = static_cast<std::uint32_t>(i * i),
                    .without_filter = random.below(5) == 0};
  return instances;
}

std::vector<DeviceInstance> on_device(const std::vector<Instance>& instances) {
  std::vector<DeviceInstance> result;
  result.reserve(instances.size());
  for (const Instance& instance : instances)
    result.push_back({instance.to_scene, instance.object, instance.mask, instance.id,
                      instance.without_filter ? InstanceFlags::kNoFilter : 0});
  return result;
}

/// A scene on the device with memory for more scenes over its objects.
class Stage {
 public:
  /// @param scene its file is made of one instance.
  /// @param slots number of scenes that fit.
  Stage(InstanceScene& scene, std::uint32_t most, const gpu::InstanceOptions& options = {}, unsigned slots = 1)
      : options_(options) {
    scene.groups.push_back({{.object = 0}});
    scene.build({.bounds = options.bounds});
    scene.groups.pop_back();
    file_ = std::move(scene.file);
    view_.emplace(*open_buffer(std::as_const(file_).bytes()));
    sizes_ = must(gpu::instance_sizes(gpu::objects_in(*view_), most, options));
    scene_.emplace(must(gpu::upload_scene(*view_, nullptr, allocator, slots * sizes_.output)));
    objects_ = gpu::objects_of(*scene_, *view_);
    scratch_ = must(gpu::DeviceBuffer::make(sizes_.scratch, nullptr, allocator));
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
  }

  /// First fills the output of the build with a poison pattern.
  const gpu::InstanceReport* enqueue(const std::vector<DeviceInstance>& instances, unsigned slot = 0) {
    const std::vector<std::byte> poison(static_cast<std::size_t>(sizes_.output), std::byte{0xa5});
    must(scene_->buffer.upload(poison, nullptr, static_cast<std::size_t>(slot * sizes_.output)));
    must(scratch_.fill(std::byte{0x5a}, nullptr));
    const unsigned before = allocator.calls;
    instances_.push_back(must(gpu::DeviceArray<DeviceInstance>::from(instances, nullptr, allocator)));
    const auto report =
        must(gpu::enqueue_instances(objects_, {instances_.back().data(), static_cast<std::uint32_t>(instances.size())},
                                    options_, scene_->buffer.data() + slot * sizes_.output, scratch_.data(), nullptr));
    CHECK(allocator.calls <= before + 1);
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
    return report;
  }
  gpu::Result<gpu::InstanceReport> read(const gpu::InstanceReport* report) {
    return gpu::read_report(report, objects_, nullptr);
  }
  build::Buffer download(const gpu::InstanceReport* report) {
    return must(gpu::download_file(must(read(report)), objects_, nullptr));
  }
  const gpu::BuildSizes& sizes() const { return sizes_; }
  const gpu::SceneObjects& objects() const { return objects_; }
  const BufferView& view() const { return *view_; }
  std::byte* capacity() { return scene_->buffer.data(); }
  std::byte* scratch() { return scratch_.data(); }

  CountingAllocator allocator;

 private:
  gpu::InstanceOptions options_;
  build::Buffer file_;
  std::optional<BufferView> view_;
  gpu::BuildSizes sizes_;
  std::optional<gpu::DeviceScene> scene_;
  gpu::SceneObjects objects_;
  gpu::DeviceBuffer scratch_;
  std::vector<gpu::DeviceArray<DeviceInstance>> instances_;
};

/// The boxes of leaves by instance.
std::vector<Box> leaf_boxes(const BufferView& view) {
  std::vector<Box> boxes(view.instances.size());
  for (const CustomLeaf& leaf : view.records<CustomLeaf>(view.leaves)) boxes[leaf.info.primitive[0]] = leaf.box[0];
  return boxes;
}

template <class T> bool same_bytes(std::span<const T> a, std::span<const T> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

/// All that does not depend on the tree.
void check_same(const BufferView& device, const BufferView& host) {
  CHECK(same_bytes(device.instances, host.instances));
  CHECK(same_bytes<Box>(leaf_boxes(device), leaf_boxes(host)));
  CHECK(same_bytes(device.geometries, host.geometries));
  CHECK(device.header->features == host.header->features);
  CHECK(device.header->levels == host.header->levels);
  CHECK(device.header->condition == host.header->condition);
  CHECK(device.header->reach == host.header->reach);
  CHECK(device.header->shutter_begin == host.header->shutter_begin);
  CHECK(device.header->shutter_rate == host.header->shutter_rate);
}

template <class LayoutType> struct Tracer : Instanced<WithLayout<LayoutType>, 2> {};

/// The same on the device and on the host.
/// @param motion of one instance in the group.
template <class LayoutType>
void check_scene(std::size_t count, InstanceBounds bounds, const build::Motion* motion = nullptr) {
  INFO(count << " instances, bounds " << static_cast<unsigned>(bounds) << ", seed " << kSeed);
  InstanceScene scene = small_objects(LayoutType::kId);
  scene.groups[0][1].motion = motion;
  Stage stage(scene, static_cast<std::uint32_t>(count), {.bounds = bounds});
  scene.groups.push_back(random_instances(count, kSeed + count));
  scene.build({.bounds = bounds});
  const build::Buffer host = std::move(scene.file);
  scene.file = stage.download(stage.enqueue(on_device(scene.groups[1])));
  const auto summary = validate(std::as_const(scene.file).bytes());
  INFO((summary ? std::string() : to_string(summary.error())));
  REQUIRE(summary.has_value());
  check_same(*open_buffer(std::as_const(scene.file).bytes()), *open_buffer(host.bytes()));
  if (count <= 50) return;
  if (motion != nullptr)
    check_rays<Moving<Tracer<LayoutType>>>(scene, kSeed, 300);
  else
    check_rays<Tracer<LayoutType>>(scene, kSeed, 300);
}

}  // namespace

TEMPLATE_TEST_CASE("trees over instances are valid and give the host's hits, in every layout", "", FloatLayout,
                   PlanesLayout, HalfLayout, QuantizedLayout) {
  check_scene<TestType>(400, InstanceBounds::kChildren);
}

TEST_CASE("boxes of instances equal the host's, for every kind of bounds") {
  check_scene<PlanesLayout>(100, InstanceBounds::kRoot);
  check_scene<PlanesLayout>(100, InstanceBounds::kGrandchildren);
}

TEST_CASE("small numbers of instances, and none") {
  for (const std::size_t count : {0u, 1u, 2u, 5u}) check_scene<PlanesLayout>(count, InstanceBounds::kChildren);
}

TEST_CASE("small numbers of instances of objects with motion") {
  const build::Motion motion{.keys = {{.time = -1, .translation = {1, 0, 0}}, {.time = 2, .translation = {-2, 1, 0}}}};
  for (const std::size_t count : {0u, 1u, 60u}) check_scene<PlanesLayout>(count, InstanceBounds::kChildren, &motion);
}

TEST_CASE("a scene is traced in place while the next one is built") {
  InstanceScene scene = small_objects(NodeLayout::kPlanes);
  constexpr std::uint32_t kCount = 200;
  Stage stage(scene, kCount, {}, 2);
  Random random(kSeed);
  std::vector<Ray> rays(256);
  for (Ray& ray : rays) ray = random_ray(random, 6.0);
  const std::vector<Instance> frames[2] = {random_instances(kCount, 1), random_instances(kCount, 2)};
  const gpu::InstanceReport* reports[2] = {};
  for (unsigned frame = 0; frame < 2; ++frame) reports[frame] = stage.enqueue(on_device(frames[frame]), frame);
  for (unsigned frame = 0; frame < 2; ++frame) {
    INFO("frame " << frame << ", seed " << kSeed);
    scene.groups.push_back(frames[frame]);
    scene.build({.bounds = InstanceBounds::kChildren});
    scene.groups.pop_back();
    const auto host = trace_instances(scene.view(), rays);
    const auto device = must(trace_instances(reports[frame], rays, MemoryOfStacks::kThread, nullptr, stage.allocator));
    CHECK(must(trace_instances(reports[frame], rays, MemoryOfStacks::kShared, nullptr, stage.allocator)) == device);
    CHECK(std::count_if(host.begin(), host.end(), [](const auto& a) { return a.primitive != kInvalidId; }) > 50);
    CHECK(device == host);
  }
}

TEST_CASE("invalid instances are refused with their numbers, and the scene is empty") {
  InstanceScene scene = small_objects(NodeLayout::kPlanes);
  Stage stage(scene, 300);
  const auto good = on_device(random_instances(300, kSeed));
  const auto refused = [&](InstanceStatus status, const auto& spoil) {
    auto instances = good;
    spoil(instances);
    const gpu::InstanceReport* report = stage.enqueue(instances);
    gpu::InstanceReport read;
    REQUIRE(hipMemcpy(&read, report, sizeof(read), hipMemcpyDeviceToHost) == hipSuccess);
    CHECK(read.status == status);
    CHECK(read.view.root == kInvalidRef);
    return error_of(stage.read(report)).message;
  };
  CHECK(refused(InstanceStatus::kNotFinite, [](auto& all) {
          all[270].to_scene.row[1][3] = std::numeric_limits<float>::infinity();
          all[290].object = 77;
        }) == "instance 270: the transform is not finite");
  CHECK(refused(InstanceStatus::kNoInverse, [](auto& all) {
          all[3].to_scene = {{{1, 1, 0, 0}, {1, 1, 0, 0}, {0, 0, 1, 0}}};
        }) == "instance 3: the transform has no inverse that floats can hold: determinant 0");
  CHECK(
      refused(InstanceStatus::kNoInverse,
              [](auto& all) {
                all[5].to_scene = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1e-13f, 0}}};
              })
          .find("instance 5: the transform has no inverse that floats can hold: determinant 1e-13, condition 3e+13") ==
      0);
  CHECK(refused(InstanceStatus::kBadObject, [](auto& all) { all[299].object = 3; }) ==
        "instance 299: object 3, the scene has 3");
  CHECK(refused(InstanceStatus::kBadFlags, [](auto& all) { all[0].flags = 2; }) ==
        "instance 0: flags that are none of InstanceFlags");
  CHECK(refused(InstanceStatus::kTooFar, [](auto& all) {
          all[7] = {.to_scene = {{{2e38f, 0, 0, 3e38f}, {0, 1, 0, 0}, {0, 0, 1, 0}}}};
          all[7].to_scene.row[1][1] = all[7].to_scene.row[2][2] = 2e38f;
        }) == "instance 7: its bounds are beyond what floats hold");
  CHECK(stage.read(stage.enqueue(good)).has_value());
}

TEST_CASE("uneven scales whose product is ill-conditioned are refused") {
  InstanceScene scene;
  scene.add_file({oracle::icosphere(0)}, NodeLayout::kPlanes);
  Affine flat;
  flat.row[2][2] = 1e-11f;
  scene.groups.push_back({{.object = 0, .to_scene = flat}});
  Stage stage(scene, 1);
  const auto error = error_of(stage.read(stage.enqueue({{.to_scene = flat, .object = 1}})));
  CHECK(error.message.find(
            "the transforms on the way to a primitive have a condition of 9e+22 together, the limit is ") == 0);
}

TEST_CASE("memory and options that are not valid are refused") {
  InstanceScene scene = small_objects(NodeLayout::kPlanes);
  Stage stage(scene, 10);
  const auto instances = must(gpu::DeviceArray<DeviceInstance>::make(10, nullptr, stage.allocator));
  const auto message = [&](std::uint32_t count, const gpu::InstanceOptions& options, std::byte* output,
                           std::byte* scratch) {
    return error_of(
               gpu::enqueue_instances(stage.objects(), {instances.data(), count}, options, output, scratch, nullptr))
        .message;
  };
  CHECK(message(10, {}, stage.capacity() + 128, stage.scratch()) ==
        "enqueue_instances: output and scratch must be aligned to 256 bytes");
  CHECK(message(10, {}, stage.capacity() + 256, stage.scratch()) ==
        "enqueue_instances: the output needs " + std::to_string(stage.sizes().output) +
            " bytes before the objects, there are " + std::to_string(stage.sizes().output - 256));
  CHECK(message(10, {.bounds = InstanceBounds::kPrimitives}, stage.capacity(), stage.scratch())
            .find("bounds of instances are made on the device of roots") == 0);
  gpu::InstanceOptions with_progress;
  with_progress.tree.progress = [](const build::Progress&) { return true; };
  CHECK(message(10, with_progress, stage.capacity(), stage.scratch()) ==
        "builds over instances do not ask whether to go on");
  CHECK(error_of(gpu::upload_scene(stage.view(), nullptr, stage.allocator, 100)).message ==
        "upload_scene: capacity of 100 bytes, which is no multiple of 256");
  CHECK(error_of(gpu::instance_sizes(stage.objects(), 0xffffffffu)).message.find("4294967295 primitives") == 0);
}
