// Compares a GPU with the host, bit for bit, for the triangle test Reference: decisions by the float filter, in double,
// and by exact arithmetic. Exit status 0 if all are equal.

#include <hip/hip_runtime.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/primitives/digest.h>

#include <cstdio>
#include <cstring>
#include <vector>

namespace gpu = hiprt::gpu;
using hiprt::PlanesLeaf, hiprt::Ray, hiprt::Reference;
using Random = hiprt::checks::DigestRandom;

namespace {

/// Of a leaf's two triangles.
struct LeafHits {
  std::uint32_t met[2] = {};
  float t[2] = {}, u[2] = {}, v[2] = {};
};

HIPRT_HD LeafHits intersect_leaf(const PlanesLeaf& leaf, const Ray& ray) {
  using Lanes = hiprt::ArrayLanes;
  LeafHits result;
  Reference::intersect<Lanes>(leaf, leaf.info, Reference::PreparedRay<Lanes>(ray),
                              [&](const hiprt::Candidate& at, unsigned i) {
                                result.met[i] = 1;
                                result.t[i] = at.t;
                                result.u[i] = at.u;
                                result.v[i] = at.v;
                                return true;
                              });
  return result;
}

__global__ void test(const PlanesLeaf* leaves, const Ray* rays, LeafHits* results, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) results[i] = intersect_leaf(leaves[i], rays[i]);
}

/// On a lattice, where rays meet edges, vertices and planes exactly; or aimed at an edge; or from near the plane.
void make_case(Random& random, unsigned kind, PlanesLeaf& leaf, Ray& ray) {
  const auto number = [&] {
    const float value = random.unit(false);
    return kind == 0 ? static_cast<float>(static_cast<int>(2.99f * value)) : value;
  };
  for (auto& axis : leaf.coordinate)
    for (float& x : axis) x = number();
  leaf.info = {{0, 1}, 0, hiprt::TriangleId::from_rotation(0) * 0x0101u};
  const float s = 0.5f + 0.5f * random.unit(false), far = kind == 2 ? 1e4f : 2.0f;
  for (int k = 0; k < 3; ++k) {
    const float* at = leaf.coordinate[k];
    ray.origin[k] = kind == 3 ? (at[0] + at[1] + at[2]) / 3 : far * number();
    ray.direction[k] = kind == 0 || kind == 3 ? number() : at[1] + s * (at[2] - at[1]) - ray.origin[k];
  }
  if (ray.direction == hiprt::Vec3(0.0f)) ray.direction = hiprt::Vec3(0.0f, 0.0f, 1.0f);
}

gpu::Result<std::vector<LeafHits>> on_device(std::span<const PlanesLeaf> leaves, std::span<const Ray> rays) {
  const hipStream_t stream = nullptr;
  gpu::DeviceAllocator allocator;
  const auto device_leaves = gpu::DeviceArray<PlanesLeaf>::from(leaves, stream, allocator);
  if (!device_leaves) return tl::unexpected(device_leaves.error());
  const auto device_rays = gpu::DeviceArray<Ray>::from(rays, stream, allocator);
  if (!device_rays) return tl::unexpected(device_rays.error());
  auto results = gpu::DeviceArray<LeafHits>::make(rays.size(), stream, allocator);
  if (!results) return tl::unexpected(results.error());
  const auto count = static_cast<unsigned>(rays.size());
  const auto done =
      gpu::launch(test, count, stream, {}, device_leaves->data(), device_rays->data(), results->data(), count);
  if (!done) return tl::unexpected(done.error());
  return results->to_vector(stream);
}

}  // namespace

int main() {
  Random random{3};
  std::vector<PlanesLeaf> leaves(4096);
  std::vector<Ray> rays(leaves.size());
  for (std::size_t i = 0; i < rays.size(); ++i) make_case(random, i % 4, leaves[i], rays[i]);
  const auto results = on_device(leaves, rays);
  if (!results) return std::fprintf(stderr, "%s\n", results.error().message.c_str()), 1;
  unsigned met = 0, wrong = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const LeafHits expected = intersect_leaf(leaves[i], rays[i]), &found = (*results)[i];
    met += expected.met[0] + expected.met[1];
    if (std::memcmp(&expected, &found, sizeof expected) == 0) continue;
    if (wrong++ == 0)
      for (unsigned k = 0; k < 2; ++k)
        std::fprintf(stderr, "case %zu, triangle %u: met %u, not %u; t %a, not %a; u %a, not %a; v %a, not %a\n", i, k,
                     found.met[k], expected.met[k], double{found.t[k]}, double{expected.t[k]}, double{found.u[k]},
                     double{expected.u[k]}, double{found.v[k]}, double{expected.v[k]});
  }
  std::printf("%zu leaves, %u triangles met, %u results differ\n", rays.size(), met, wrong);
  return wrong == 0 && met > 500 ? 0 : 1;
}
