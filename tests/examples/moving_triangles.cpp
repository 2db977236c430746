#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/shapes.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/primitives/scene_shapes.h>

#include <cstdio>

int main() {
  // Three vertices at time 0, then the same ones at time 1.
  const hiprt::ShapePoint vertices[] = {{{-1, -1, 0}, 0}, {{1, -1, 0}, 0}, {{0, 1, 0}, 0},
                                        {{-1, -1, 2}, 1}, {{1, -1, 2}, 1}, {{0, 1, 3}, 1}};
  const std::uint32_t corners[] = {0, 1, 2};
  const hiprt::build::Shapes flap{hiprt::ShapeKind::kMovingTriangles, vertices, corners, 2};
  const auto boxes = hiprt::build::shape_boxes(flap);
  const hiprt::build::CustomGeometry geometry[] = {{.boxes = boxes.value(), .shapes = flap}};
  const auto bvh = hiprt::build::build(hiprt::build::SceneInput{.customs = geometry});
  if (!bvh) return 1;

  const hiprt::SceneView scene = hiprt::make_scene_view(*hiprt::open_buffer(bvh->buffer.bytes()));
  for (const float time : {0.0f, 0.5f, 1.0f}) {
    const hiprt::Ray ray{.origin = {0, -1, 4}, .direction = {0, 0, -1}, .time = time};
    hiprt::PrivateStack<>::Memory stack;
    using Query = hiprt::ClosestHit<hiprt::Policies, hiprt::NoFilter, hiprt::SceneShapes>;
    const hiprt::Hit hit = Query(scene, ray, stack, {}, hiprt::SceneShapes(scene)).next_hit();
    std::printf("time %.1f: t = %.1f\n", time, hit.t);
  }
}
