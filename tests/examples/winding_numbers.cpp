#include <hiprt_build/build.h>
#include <hiprt_build/winding.h>
#include <hiprt_device/query/winding_number.h>

#include <cstdio>
#include <vector>

int main() {
  // Three sides of a tetrahedron: the one below is missing.
  const std::vector<hiprt::build::Position> positions{{0, 0, 1}, {1, 0, 0}, {-0.5f, 0.9f, 0}, {-0.5f, -0.9f, 0}};
  const std::vector<hiprt::build::Triangle> triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 1}};
  const std::vector<hiprt::build::TriangleMesh> meshes{{positions, triangles}};
  const auto bvh = hiprt::build::build(meshes);
  if (!bvh) return std::puts(bvh.error().message.c_str());
  const auto arrays = hiprt::build::winding_arrays(*hiprt::open_buffer(bvh->buffer.bytes()));
  if (!arrays) return std::puts(arrays.error().message.c_str());
  const hiprt::WindingNumber number = hiprt::winding_number(arrays->tree(), {0, 0, 0.4});
  const bool inside = hiprt::is_inside(arrays->tree(), {0, 0, 0.4}) == hiprt::Side::kInside;
  std::printf("winding number %.3f: %s\n", number.value, inside ? "inside" : "outside");
}
