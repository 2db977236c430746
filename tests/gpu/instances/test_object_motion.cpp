// Motions that the device reads: bounds, hits, and the refusal of invalid ones.

#include <hiprt_build/instances/gpu_motion.h>
#include <hiprt_build/instances/make_instance.h>
#include <hiprt_build/instances/motion_segments.h>
#include <tests/gpu/instances/object_scenes.h>

using namespace hiprt;
using namespace hiprt::checks;
using build::MatrixKey;
using build::MotionKey;
using Catch::Matchers::Contains;
using gpu::KeyRange;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261127;

}  // namespace

TEST_CASE("motions on the device: valid bounds, and the hits of a loop over all instances") {
  INFO("seed " << kSeed);
  World world(kSeed);
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
  TopLevel top(world, world.objects(), kCount, key_count);
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
  World world(kSeed);
  const std::vector<Instance> instances(3, Instance{.object = 0});
  const std::vector<KeyRange> ranges{{0, 0}, {0, 0}, {1, 3}};
  const std::vector<MotionKey> good{{}, {.time = 0}, {.time = 1}, {.time = 2}};
  TopLevel top(world, world.objects(), 3, 4);
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
  TopLevel other(world, wide, 3);
  CHECK(error_of(gpu::read_report(other.run(instances), wide, nullptr)).message ==
        "instance 0: object 0 has another node layout than the scene's objects");
}
