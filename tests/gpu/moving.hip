// Compares a GPU with the host, bit for bit, in moving scenes: nested instances (decomposed and matrix keys), and a
// deforming mesh. Exit status 0 if all hits are equal.

#include <hip/hip_runtime.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_build/instances.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/primitives/moving_triangle.h>
#include <tests/primitives/digest.h>

#include <cstdio>
#include <cstring>
#include <vector>

namespace gpu = hiprt::gpu;
using hiprt::Ray, hiprt::SceneView;
using hiprt::build::Instance, hiprt::build::Motion;
using Random = hiprt::checks::DigestRandom;

namespace {

using P = hiprt::Moving<hiprt::Instanced<hiprt::Policies, 2>>;

struct RayHits {
  float t = 0, u = 0, v = 0, error = 0, normal[3] = {};
  std::uint32_t primitive = 0, instance[2] = {};
  float deforming[5] = {};  ///< t, u, v, error and a component of the normal.
};

/// A triangle at two times.
struct Deforming {
  float positions[18] = {-1, -1, 0, 1, -1, 0, 0, 1, 0, -1, -1, 1, 1.5f, -1, 0, 0.25f, 1.5f, -1};
  float times[2] = {0, 1};
  std::uint32_t triangle[3] = {0, 1, 2};
};

HIPRT_HD RayHits trace_ray(const SceneView& scene, const Deforming& mesh, const Ray& ray) {
  const auto hit = hiprt::closest_hit<P>(scene, ray);
  RayHits result{hit.t, hit.u, hit.v, hit.error, {hit.normal.x, hit.normal.y, hit.normal.z}, hit.primitive};
  for (unsigned i = 0; i < hit.path.depth; ++i) result.instance[i] = 1 + hit.path.instance[i];
  const hiprt::MovingTriangleSet set{{mesh.positions, mesh.times, mesh.triangle, 3, 2}};
  set.intersect(ray, -1e30f, 1e30f, 0, [&](const hiprt::CustomHit& found) {
    const float values[5] = {found.t, found.u, found.v, found.error, found.normal.x};
    for (unsigned i = 0; i < 5; ++i) result.deforming[i] = values[i];
    return true;
  });
  return result;
}

__global__ void trace(SceneView scene, const Deforming* mesh, const Ray* rays, RayHits* results, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) results[i] = trace_ray(scene, *mesh, rays[i]);
}

/// Two levels of instances of tetrahedra, each with its own motion.
hiprt::build::Result<hiprt::build::Bvh> make_scene(std::vector<Motion>& motions) {
  const std::vector<hiprt::build::Position> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<hiprt::build::Triangle> triangles{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  const std::vector<hiprt::build::TriangleMesh> mesh{{positions, triangles}};
  const auto object = hiprt::build::build(mesh);
  if (!object) return tl::unexpected(object.error());
  Random random{1};
  const auto number = [&](float most) { return most * random.unit(false); };
  motions.resize(24);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    Motion& motion = motions[i];
    motion.kind = static_cast<hiprt::MotionKind>(1 + i % 3);
    const float turn = motion.kind == hiprt::MotionKind::kMatrix ? 0.2f : 1.0f;
    for (float time : {0.0f, 0.3f, 1.0f})
      motion.keys.push_back({.time = time,
                             .translation = {number(3), number(3), number(3)},
                             .rotation = {number(turn), number(turn), number(turn), 1},
                             .scale = {1 + number(0.2f), 1 + number(0.2f), 1 + number(0.2f)},
                             .shear = {number(0.1f), number(0.1f), number(0.1f)}});
  }
  std::vector<Instance> inner(12), outer(12);
  for (std::size_t i = 0; i < 12; ++i) {
    inner[i].motion = &motions[i];
    outer[i] = {.object = 1, .motion = &motions[12 + i]};
  }
  const std::vector<std::span<const std::byte>> files{object->buffer.bytes()};
  const std::vector<std::span<const Instance>> groups{inner, outer};
  return hiprt::build::build_instances(hiprt::build::InstancedScene{files, groups});
}

gpu::Result<std::vector<RayHits>> on_device(std::span<const std::byte> file, const Deforming& deforming,
                                            std::span<const Ray> rays) {
  const hipStream_t stream = nullptr;
  gpu::DeviceAllocator allocator;
  const auto scene = gpu::upload_scene(file, stream, allocator);
  if (!scene) return tl::unexpected(scene.error());
  const auto mesh = gpu::DeviceArray<Deforming>::from({&deforming, 1}, stream, allocator);
  if (!mesh) return tl::unexpected(mesh.error());
  const auto device_rays = gpu::DeviceArray<Ray>::from(rays, stream, allocator);
  if (!device_rays) return tl::unexpected(device_rays.error());
  auto results = gpu::DeviceArray<RayHits>::make(rays.size(), stream, allocator);
  if (!results) return tl::unexpected(results.error());
  const auto count = static_cast<unsigned>(rays.size());
  const auto done =
      gpu::launch(trace, count, stream, {}, scene->view, mesh->data(), device_rays->data(), results->data(), count);
  if (!done) return tl::unexpected(done.error());
  return results->to_vector(stream);
}

}  // namespace

int main() {
  std::vector<Motion> motions;
  const auto scene = make_scene(motions);
  if (!scene) return std::fprintf(stderr, "%s\n", scene.error().message.c_str()), 1;
  Random random{2};
  std::vector<Ray> rays(4096);
  for (Ray& ray : rays) {
    for (int axis = 0; axis < 3; ++axis) {
      ray.origin[axis] = 8 * random.unit(false);
      ray.direction[axis] = 3 * random.unit(false) - ray.origin[axis];
    }
    ray.time = 0.5f + 0.75f * random.unit(false);
  }
  const Deforming mesh;
  const auto results = on_device(scene->buffer.bytes(), mesh, rays);
  if (!results) return std::fprintf(stderr, "%s\n", results.error().message.c_str()), 1;
  const SceneView view = hiprt::make_scene_view(*hiprt::open_buffer(scene->buffer.bytes()));
  unsigned hits = 0, deforming = 0, different = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const RayHits here = trace_ray(view, mesh, rays[i]);
    hits += here.instance[1] != 0 ? 1 : 0;
    deforming += here.deforming[3] > 0 ? 1 : 0;
    different += std::memcmp(&here, &(*results)[i], sizeof(RayHits)) != 0 ? 1 : 0;
  }
  std::printf("%zu rays, %u hits of instances, %u of a deforming triangle, %u results differ\n", rays.size(), hits,
              deforming, different);
  return different == 0 && hits > 400 && deforming > 100 ? 0 : 1;
}
