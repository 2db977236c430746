// Compares a GPU with the host, bit for bit, for rays in double: triangles, nested instances, moving instances, and
// every kind of custom primitive. Exit status 0 if all hits are equal.

#include <hip/hip_runtime.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_build/instances.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/primitives/double_triangle.h>
#include <hiprt_device/primitives/moving_triangle.h>
#include <hiprt_device/primitives/round_curve.h>
#include <hiprt_device/primitives/sphere.h>
#include <tests/primitives/digest.h>

#include <cstdio>
#include <cstring>
#include <vector>

namespace gpu = hiprt::gpu;
using hiprt::RayD, hiprt::SceneView;
using hiprt::build::Instance, hiprt::build::Motion;
using Random = hiprt::checks::DigestRandom;

namespace {

using Flat = hiprt::DoubleRays<>;
using Deep = hiprt::Moving<hiprt::Instanced<hiprt::DoubleRays<>, 2>>;

struct RayHits {
  double t[3] = {}, u[2] = {}, v[2] = {};
  double normal[2][3] = {};
  float error[2] = {};
  std::uint32_t primitive[2] = {}, instance[2] = {};
  double custom[4][4] = {};  ///< t, u, v and error of the last crossing.
};

/// One of each custom primitive.
struct Shapes {
  double positions[9] = {-1, -1, 0.1, 1.3, -1, 0, 0, 1, 1.0 / 3};
  float moving[18] = {-1, -1, 0, 1, -1, 0, 0, 1, 0, -1, -1, 1, 1.5f, -1, 0, 0.25f, 1.5f, -1};
  float times[2] = {0, 1};
  std::uint32_t triangle[3] = {0, 1, 2}, segment[1] = {0};
  hiprt::Sphere sphere{{0.25f, 0, 0}, 1.5f};
  hiprt::CurveVertex curve[2] = {{{0, -1, 0}, 1}, {{0.5f, 1, 0.25f}, 0.5f}};
};

template <unsigned kPart, class Hit> HIPRT_HD void put(const Hit& hit, RayHits& result) {
  result.t[kPart] = hit.t;
  result.u[kPart] = hit.u;
  result.v[kPart] = hit.v;
  result.error[kPart] = hit.error;
  result.primitive[kPart] = hit.primitive;
  result.normal[kPart][0] = hit.normal.x;
  result.normal[kPart][1] = hit.normal.y;
  result.normal[kPart][2] = hit.normal.z;
}

template <class Set> HIPRT_HD void cross(const Set& set, const RayD& ray, double (&to)[4]) {
  set.intersect(ray, -1e300, 1e300, 0, [&](const hiprt::CustomHitD& hit) {
    to[0] = hit.t, to[1] = hit.u, to[2] = hit.v, to[3] = hit.error;
    return true;
  });
}

HIPRT_HD RayHits trace_ray(const SceneView& flat, const SceneView& deep, const Shapes& shapes, const RayD& ray) {
  RayHits result;
  put<0>(hiprt::closest_hit<Flat>(flat, ray), result);
  const auto hit = hiprt::closest_hit<Deep>(deep, ray);
  put<1>(hit, result);
  for (unsigned i = 0; i < hit.path.depth; ++i) result.instance[i] = 1 + hit.path.instance[i];
  result.t[2] = hiprt::any_hit<Flat>(flat, ray).found() ? 1.0 : 0.0;
  cross(hiprt::DoubleTriangleSet{{shapes.positions, shapes.triangle}}, ray, result.custom[0]);
  cross(hiprt::MovingTriangleSet{{shapes.moving, shapes.times, shapes.triangle, 3, 2}}, ray, result.custom[1]);
  cross(hiprt::SphereSet{&shapes.sphere}, ray, result.custom[2]);
  cross(hiprt::RoundCurveSet{shapes.curve, shapes.segment}, ray, result.custom[3]);
  return result;
}

__global__ void trace(SceneView flat, SceneView deep, const Shapes* shapes, const RayD* rays, RayHits* results,
                      unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) results[i] = trace_ray(flat, deep, *shapes, rays[i]);
}

/// A tetrahedron.
hiprt::build::Result<hiprt::build::Bvh> make_object() {
  const std::vector<hiprt::build::Position> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<hiprt::build::Triangle> triangles{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  const std::vector<hiprt::build::TriangleMesh> mesh{{positions, triangles}};
  return hiprt::build::build(mesh);
}

/// Two levels of instances of it, every other one moving, ten million units away.
hiprt::build::Result<hiprt::build::Bvh> make_scene(std::span<const std::byte> object, std::vector<Motion>& motions) {
  Random random{1};
  const auto number = [&](float most) { return most * random.unit(false); };
  motions.resize(6);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    motions[i].kind = static_cast<hiprt::MotionKind>(1 + i % 3);
    for (float time : {0.0f, 1.0f})
      motions[i].keys.push_back({.time = time,
                                 .translation = {number(3), number(3), number(3)},
                                 .rotation = {number(0.2f), number(0.2f), number(0.2f), 1}});
  }
  std::vector<Instance> inner(12), outer(2);
  for (std::size_t i = 0; i < 12; ++i) {
    if (i % 2 == 0) inner[i].motion = &motions[i / 2];
    for (unsigned row = 0; row < 3; ++row) inner[i].to_scene.row[row][3] = number(3);
  }
  for (unsigned i = 0; i < 2; ++i) {
    outer[i].object = 1;
    outer[i].to_scene.row[0][3] = 1e7f + 2.0f * static_cast<float>(i);
  }
  const std::vector<std::span<const std::byte>> files{object};
  const std::vector<std::span<const Instance>> groups{inner, outer};
  return hiprt::build::build_instances(hiprt::build::InstancedScene{files, groups});
}

gpu::Result<std::vector<RayHits>> on_device(std::span<const std::byte> flat, std::span<const std::byte> deep,
                                            const Shapes& shapes, std::span<const RayD> rays) {
  const hipStream_t stream = nullptr;
  gpu::DeviceAllocator allocator;
  const auto flat_scene = gpu::upload_scene(flat, stream, allocator);
  if (!flat_scene) return tl::unexpected(flat_scene.error());
  const auto deep_scene = gpu::upload_scene(deep, stream, allocator);
  if (!deep_scene) return tl::unexpected(deep_scene.error());
  const auto device_shapes = gpu::DeviceArray<Shapes>::from({&shapes, 1}, stream, allocator);
  if (!device_shapes) return tl::unexpected(device_shapes.error());
  const auto device_rays = gpu::DeviceArray<RayD>::from(rays, stream, allocator);
  if (!device_rays) return tl::unexpected(device_rays.error());
  auto results = gpu::DeviceArray<RayHits>::make(rays.size(), stream, allocator);
  if (!results) return tl::unexpected(results.error());
  const auto count = static_cast<unsigned>(rays.size());
  const auto done = gpu::launch(trace, count, stream, {}, flat_scene->view, deep_scene->view, device_shapes->data(),
                                device_rays->data(), results->data(), count);
  if (!done) return tl::unexpected(done.error());
  return results->to_vector(stream);
}

}  // namespace

int main() {
  std::vector<Motion> motions;
  const auto object = make_object();
  if (!object) return std::fprintf(stderr, "%s\n", object.error().message.c_str()), 1;
  const auto scene = make_scene(object->buffer.bytes(), motions);
  if (!scene) return std::fprintf(stderr, "%s\n", scene.error().message.c_str()), 1;
  Random random{2};
  std::vector<RayD> rays(4096);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    // About the flat scene, or about the instances.
    const bool far = i % 2 == 1;
    const auto number = [&](double most) { return most * static_cast<double>(random.unit(false)); };
    for (int axis = 0; axis < 3; ++axis) {
      rays[i].origin[axis] = number(8);
      rays[i].direction[axis] = number(far ? 3 : 0.75) + 0.25 - rays[i].origin[axis];
    }
    if (far) rays[i].origin.x += 1e7;
    if (i % 4 == 0) {
      rays[i].origin -= 1e6 * rays[i].direction;
      rays[i].direction *= 1e-5;
    }
    rays[i].time = 0.5f + 0.75f * random.unit(false);
  }
  const Shapes shapes;
  const auto results = on_device(object->buffer.bytes(), scene->buffer.bytes(), shapes, rays);
  if (!results) return std::fprintf(stderr, "%s\n", results.error().message.c_str()), 1;
  const auto view_of = [](const hiprt::build::Bvh& bvh) {
    return hiprt::make_scene_view(*hiprt::open_buffer(bvh.buffer.bytes()));
  };
  const SceneView flat = view_of(*object), deep = view_of(*scene);
  unsigned found[6] = {}, different = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const RayHits expected = trace_ray(flat, deep, shapes, rays[i]);
    found[0] += expected.primitive[0] != hiprt::kInvalidId;
    found[1] += expected.primitive[1] != hiprt::kInvalidId;
    for (unsigned k = 0; k < 4; ++k) found[2 + k] += expected.custom[k][3] != 0.0;
    if (std::memcmp(&expected, &(*results)[i], sizeof(RayHits)) != 0 && ++different <= 3)
      std::fprintf(stderr, "ray %zu: t %.17g %.17g, on the host %.17g %.17g\n", i, (*results)[i].t[0],
                   (*results)[i].t[1], expected.t[0], expected.t[1]);
  }
  std::printf("%zu rays, %u, %u and on custom primitives %u, %u, %u, %u hits; %u differ\n", rays.size(), found[0],
              found[1], found[2], found[3], found[4], found[5], different);
  for (const unsigned hits : found)
    if (hits < 100) return std::fprintf(stderr, "too few hits to tell\n"), 1;
  return different == 0 ? 0 : 1;
}
