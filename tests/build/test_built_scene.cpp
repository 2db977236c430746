// The results of a build besides the file: the view of the scene, and the counts of dropped primitives.

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/oracle/meshes.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::oracle;

namespace {

build::Bvh built(const Mesh& mesh) {
  auto bvh = build::build(std::vector{mesh.view()});
  REQUIRE(bvh.has_value());
  return std::move(*bvh);
}

}  // namespace

TEST_CASE("a build gives the view of its scene") {
  const build::Bvh bvh = built(icosphere(3));
  const SceneView scene = bvh.scene();
  CHECK(scene.base == bvh.buffer.bytes().data());
  CHECK(scene.size == bvh.buffer.size());
  Ray ray;
  ray.origin = {0.1f, 0.2f, -3};
  ray.direction = {0, 0, 1};
  CHECK(closest_hit(scene, ray).found());
}

TEST_CASE("instances of empty objects are counted as dropped degenerate primitives") {
  const build::Bvh ball = built(icosphere(1)), empty = built(Mesh{});
  const std::span<const std::byte> files[] = {ball.buffer.bytes(), empty.buffer.bytes()};
  for (const build::InstanceBounds bounds : {build::InstanceBounds::kRoot, build::InstanceBounds::kPrimitives}) {
    const build::Instance instances[] = {{.object = 0}, {.object = 1}, {.object = 1}, {.object = 0}};
    const auto scene = build::build_instances(files, instances, {.bounds = bounds});
    REQUIRE(scene.has_value());
    CHECK(scene->statistics.dropped_degenerate == 2);
    CHECK(scene->statistics.dropped_not_finite == 0);
  }
}
