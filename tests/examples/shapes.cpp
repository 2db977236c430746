#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/shapes.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/primitives/scene_shapes.h>

#include <cstdio>

int main() {
  const hiprt::ShapePoint balls[] = {{{-2, 0, 0}, 1}, {{2, 0, 0}, 0.5f}};                    // Centre, radius.
  const hiprt::ShapePoint axis[] = {{{0, -1, 0}, 0.2f}, {{0, 0, 0}, 0.1f}, {{0, 1, 0}, 0}};  // A strand,
  const std::uint32_t segments[] = {0, 1};  // from its points 0 and 1 to the next.
  const hiprt::build::Shapes spheres{hiprt::ShapeKind::kSpheres, balls, {}};
  const hiprt::build::Shapes curves{hiprt::ShapeKind::kCurves, axis, segments};
  const auto sphere_boxes = hiprt::build::shape_boxes(spheres), curve_boxes = hiprt::build::shape_boxes(curves);
  const hiprt::build::CustomGeometry geometries[] = {{.boxes = sphere_boxes.value(), .shapes = spheres},
                                                     {.boxes = curve_boxes.value(), .shapes = curves}};
  const auto bvh = hiprt::build::build(hiprt::build::SceneInput{.customs = geometries});
  if (!bvh) return 1;

  // From here on the file is all there is.
  const hiprt::SceneView scene = hiprt::make_scene_view(*hiprt::open_buffer(bvh->buffer.bytes()));
  for (const float x : {-2.0f, 0.0f, 1.0f, 2.0f}) {
    const hiprt::Ray ray{.origin = {x, -0.5f, 4}, .direction = {0, 0, -1}};
    hiprt::PrivateStack<>::Memory stack;
    using Query = hiprt::ClosestHit<hiprt::Policies, hiprt::NoFilter, hiprt::SceneShapes>;
    const hiprt::Hit hit = Query(scene, ray, stack, {}, hiprt::SceneShapes(scene)).next_hit();
    std::printf("x = %2.0f: t = %.4f, geometry %d\n", x, hit.t, hit.found() ? static_cast<int>(hit.geometry) : -1);
  }
}
