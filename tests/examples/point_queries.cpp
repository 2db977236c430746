#include <hiprt_build/build.h>
#include <hiprt_device/hiprt_device.h>

#include <cstdio>
#include <vector>

int main() {
  const std::vector<hiprt::build::Position> positions{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {4, 4, 0}};
  const std::vector<hiprt::build::Triangle> triangles{{0, 1, 2}, {1, 3, 2}};
  const std::vector<hiprt::build::TriangleMesh> meshes{{positions, triangles}};
  const auto bvh = hiprt::build::build(meshes);
  if (!bvh) return std::puts(bvh.error().message.c_str());
  const hiprt::ClosestPoint near = hiprt::closest_point(bvh->scene(), {1, -3, 4});
  std::printf("distance %g at (%g, %g, %g): ", static_cast<double>(near.distance()), static_cast<double>(near.point.x),
              static_cast<double>(near.point.y), static_cast<double>(near.point.z));
  std::printf("edge 0 of triangle %u\n", near.feature == hiprt::TriangleFeature::kEdge0 ? near.primitive : ~0u);
}
