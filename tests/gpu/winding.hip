// Compares a GPU with the host, bit for bit, for winding numbers and insides of a mesh with holes. Exit status 0 if all
// results are equal.

#include <hip/hip_runtime.h>
#include <hiprt_build/build.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_build/winding.h>
#include <hiprt_device/query/winding_number.h>
#include <tests/primitives/digest.h>

#include <cstdio>
#include <cstring>
#include <vector>

namespace gpu = hiprt::gpu;
using hiprt::Vec3D, hiprt::WindingNumber, hiprt::WindingTree;
using Random = hiprt::checks::DigestRandom;

namespace {

struct Results {
  WindingNumber far, exact;
  std::uint64_t side;
};

HIPRT_HD Results ask(const WindingTree& tree, const Vec3D& point) {
  return {hiprt::winding_number(tree, point, 4.0),
          hiprt::winding_number(tree, point, std::numeric_limits<double>::infinity()),
          static_cast<std::uint64_t>(hiprt::is_inside(tree, point))};
}

__global__ void ask_all(WindingTree tree, const Vec3D* points, Results* results, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) results[i] = ask(tree, points[i]);
}

/// A bumpy box around the origin, without the middle of its upper side.
hiprt::build::Result<hiprt::build::WindingArrays> make_arrays() {
  std::vector<hiprt::build::Position> positions;
  std::vector<hiprt::build::Triangle> triangles;
  constexpr unsigned kSide = 8;
  Random random{3};
  for (unsigned face = 0; face < 6; ++face) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    for (unsigned i = 0; i <= kSide; ++i)
      for (unsigned k = 0; k <= kSide; ++k) {
        const float u = 0.25f * static_cast<float>(i) - 1, v = 0.25f * static_cast<float>(k) - 1;
        const float height = (face % 2 == 0 ? 1.0f : -1.0f) * (1.0f + 0.0625f * random.unit(false));
        const float at[3] = {height, face % 2 == 0 ? u : v, face % 2 == 0 ? v : u};
        const unsigned axis = face / 2;
        positions.push_back({at[(3 - axis) % 3], at[(4 - axis) % 3], at[(5 - axis) % 3]});
      }
    for (std::uint32_t i = 0; i < kSide; ++i)
      for (std::uint32_t k = 0; k < kSide; ++k) {
        if (face == 0 && i / 2 == 1 && k / 2 == 1) continue;
        const std::uint32_t a = first + i * (kSide + 1) + k, b = a + kSide + 1;
        triangles.push_back({a, b, b + 1});
        triangles.push_back({a, b + 1, a + 1});
      }
  }
  const std::vector<hiprt::build::TriangleMesh> mesh{{positions, triangles}};
  const auto bvh = hiprt::build::build(mesh);
  if (!bvh) return tl::unexpected(bvh.error());
  return hiprt::build::winding_arrays(*hiprt::open_buffer(bvh->buffer.bytes()));
}

gpu::Result<std::vector<Results>> on_device(const hiprt::build::WindingArrays& arrays,
                                            const std::vector<Vec3D>& points) {
  const hipStream_t stream = nullptr;
  gpu::DeviceAllocator allocator;
  const auto nodes = gpu::DeviceArray<hiprt::WindingNode>::from(arrays.nodes, stream, allocator);
  if (!nodes) return tl::unexpected(nodes.error());
  const auto triangles = gpu::DeviceArray<hiprt::WindingTriangle>::from(arrays.triangles, stream, allocator);
  if (!triangles) return tl::unexpected(triangles.error());
  const auto device_points = gpu::DeviceArray<Vec3D>::from(points, stream, allocator);
  if (!device_points) return tl::unexpected(device_points.error());
  const std::vector<Results> empty(points.size());
  auto results = gpu::DeviceArray<Results>::from(empty, stream, allocator);
  if (!results) return tl::unexpected(results.error());
  const WindingTree tree{nodes->data(), triangles->data(), arrays.tree().node_count};
  const auto count = static_cast<unsigned>(points.size());
  const auto done = gpu::launch(ask_all, count, nullptr, {}, tree, device_points->data(), results->data(), count);
  if (!done) return tl::unexpected(done.error());
  return results->to_vector(stream);
}

}  // namespace

int main() {
  const auto arrays = make_arrays();
  if (!arrays) return std::fprintf(stderr, "%s\n", arrays.error().message.c_str()), 1;
  Random random{2};
  std::vector<Vec3D> points(512);
  for (Vec3D& point : points) {
    const float x = random.unit(true), y = random.unit(true), z = random.unit(true);
    point = 1.5 * Vec3D(x, y, z);
  }
  const auto results = on_device(*arrays, points);
  if (!results) return std::fprintf(stderr, "%s\n", results.error().message.c_str()), 1;
  unsigned inside = 0, different = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Results expected = ask(arrays->tree(), points[i]);
    inside += expected.side == static_cast<std::uint64_t>(hiprt::Side::kInside);
    if (std::memcmp(&expected, &(*results)[i], sizeof(Results)) != 0 && ++different <= 3)
      std::fprintf(stderr, "point %zu: %.17g, on the host %.17g\n", i, (*results)[i].exact.value, expected.exact.value);
  }
  std::printf("%zu points, %u inside; %u differ\n", points.size(), inside, different);
  if (inside < 50 || inside + 50 > points.size()) return std::fprintf(stderr, "too few to tell\n"), 1;
  return different == 0 ? 0 : 1;
}
