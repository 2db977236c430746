#include <hiprt_build/build.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/math/vec_functions.h>
#include <hiprt_device/primitives/sphere.h>

#include <cstdio>

struct Crates {  // Solid boxes: a point inside is at distance 0.
  const hiprt::Box* crates;
  HIPRT_HD hiprt::CustomPoint closest(const hiprt::PointInObject& at, std::uint32_t i) const {
    const auto& [low, high] = crates[i];
    const auto point = glm::clamp(at.point, {low[0], low[1], low[2]}, {high[0], high[1], high[2]});
    const hiprt::Vec3D away = at.point - point;
    return {.squared = glm::dot(away, away), .point = point};
  }
};

int main() {
  const hiprt::Sphere ball{{0, 0, 0}, 1};
  const hiprt::Box ball_box = hiprt::SphereSet::bounds(ball), crate{{2, -1, -1}, {3, 1, 1}};
  const hiprt::build::CustomGeometry geometries[] = {{{&ball_box, 1}, 0}, {{&crate, 1}, 1}};  // Boxes, type.
  const auto bvh = hiprt::build::build(hiprt::build::SceneInput{{}, geometries});
  if (!bvh) return std::puts(bvh.error().message.c_str());
  const hiprt::PrimitiveList<hiprt::SphereSet, Crates> shapes{hiprt::SphereSet{&ball}, Crates{&crate}};
  for (const float x : {-3.0f, 2.5f}) {
    const auto near = hiprt::closest_point<hiprt::Policies>(bvh->scene(), {.point = {x, 0, 0}}, shapes);
    std::printf("squared distance %g, geometry %u\n", near.distance_squared, near.geometry);
  }
}
