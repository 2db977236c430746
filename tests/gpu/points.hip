// Compares a GPU with the host, bit for bit, for point queries: the closest point of a flat scene and of nested, moving
// instances; the nearest three; insides; overlaps; spheres and curves beside triangles. Exit status 0 if all results
// are equal.

#include <hip/hip_runtime.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/shapes.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/primitives/scene_shapes.h>
#include <tests/primitives/digest.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

namespace gpu = hiprt::gpu;
using hiprt::SceneView, hiprt::Vec3;
using hiprt::build::Instance, hiprt::build::Motion;
using Random = hiprt::checks::DigestRandom;

namespace {

using Flat = hiprt::WithLayout<hiprt::QuantizedLayout>;
using Deep = hiprt::Moving<hiprt::Instanced<Flat, 2>>;

struct Results {
  double squared[6] = {};
  float point[3][3] = {}, u[3] = {}, v[3] = {};
  std::uint32_t primitive[6] = {}, feature[3] = {}, instance[2] = {}, geometry = 0;
  std::uint32_t side = 0, boxes = 0, exact = 0;
};

template <unsigned kPart, class Point> HIPRT_HD void put(const Point& near, Results& results) {
  results.squared[kPart] = near.distance_squared;
  results.point[kPart][0] = near.point.x;
  results.point[kPart][1] = near.point.y;
  results.point[kPart][2] = near.point.z;
  results.u[kPart] = near.u;
  results.v[kPart] = near.v;
  results.primitive[kPart] = near.primitive;
  results.feature[kPart] = static_cast<std::uint32_t>(near.feature);
}

struct TakeAll {
  template <class Overlap> HIPRT_HD bool operator()(const Overlap&) const { return true; }
};

/// One kernel per query. amdrun then translates small kernels, one at a time.
enum Part : unsigned { kClosest, kDeep, kNearest, kSigned, kBoxes, kDeepBoxes, kShapes, kParts };

/// The files that are asked, on a host or a device.
struct Scenes {
  SceneView flat, deep, shapes;
};

template <unsigned kPart> HIPRT_HD void ask(const Scenes& scenes, const Vec3& point, float time, Results& results) {
  const SceneView &flat = scenes.flat, &deep = scenes.deep, &shapes = scenes.shapes;
  if constexpr (kPart == kClosest) put<0>(hiprt::closest_point<Flat>(flat, {.point = point}), results);
  if constexpr (kPart == kDeep) {
    const auto near = hiprt::closest_point<Deep>(deep, {.point = point, .time = time});
    put<1>(near, results);
    for (unsigned i = 0; i < near.path.depth; ++i) results.instance[i] = 1 + near.path.instance[i];
  }
  if constexpr (kPart == kNearest) {
    Flat::Stack::Memory memory;
    hiprt::ClosestPoint nearest[3];
    const auto found = hiprt::nearest_points<Flat>(flat, {.point = point}, nearest, 3, memory);
    for (unsigned i = 0; i < found.count; ++i) {
      results.squared[3 + i] = nearest[i].distance_squared;
      results.primitive[3 + i] = nearest[i].primitive;
    }
  }
  if constexpr (kPart == kSigned)
    results.side = static_cast<std::uint32_t>(hiprt::is_inside<Flat>(flat, {.point = point}));
  if constexpr (kPart == kBoxes) {
    Flat::Stack::Memory memory;
    const hiprt::Box box{{point.x, point.y, point.z}, {point.x + 0.5f, point.y + 0.25f, point.z + 0.125f}};
    results.exact = hiprt::overlaps<Flat>(flat, hiprt::ExactBox{box}, memory, TakeAll{}).count;
  }
  if constexpr (kPart == kDeepBoxes) {
    Deep::Stack::Memory memory;
    const hiprt::OrientedBox turned{point, {{0.5f, 0.25f, 0}, {-0.25f, 0.5f, 0}, {0, 0.125f, 0.25f}}};
    results.boxes = hiprt::overlaps<Deep>(deep, turned, memory, TakeAll{}, {.time = time}).count;
  }
  if constexpr (kPart == kShapes) {
    const auto near = hiprt::closest_point<Deep>(shapes, {.point = point}, hiprt::SceneShapes(shapes));
    put<2>(near, results);
    results.geometry = near.geometry;
  }
}

/// @param results each query writes its own part.
template <unsigned kPart> __global__ void ask_all(Scenes scenes, const Vec3* points, Results* results, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) ask<kPart>(scenes, points[i], 0.25f * static_cast<float>(i % 5), results[i]);
}

/// A closed surface around the origin: an octahedron whose faces are split, with corners at different distances.
hiprt::build::Result<hiprt::build::Bvh> make_object() {
  std::vector<hiprt::build::Position> positions;
  std::vector<hiprt::build::Triangle> triangles;
  constexpr unsigned kAround = 12, kRings = 7;
  constexpr float kTurn[kAround][2] = {{16, 0},  {14, 8},   {8, 14},   {0, 16},  {-8, 14}, {-14, 8},
                                       {-16, 0}, {-14, -8}, {-8, -14}, {0, -16}, {8, -14}, {14, -8}};
  Random random{3};
  for (unsigned ring = 0; ring < kRings; ++ring)
    for (const auto& turn : kTurn) {
      const float wide = 0x1p-5f * (1.5f + 0.5f * random.unit(true)) * (ring == 0 || ring + 1 == kRings ? 0.25f : 1.0f);
      positions.push_back({turn[0] * wide, turn[1] * wide, 0.25f * static_cast<float>(ring) - 0.75f});
    }
  for (const float z : {-1.0f, 1.0f}) positions.push_back({0, 0, z});
  for (unsigned k = 0; k < kAround; ++k) {
    const unsigned next = (k + 1) % kAround, last = (kRings - 1) * kAround;
    triangles.push_back({kRings * kAround, next, k});
    triangles.push_back({kRings * kAround + 1, last + k, last + next});
    for (unsigned ring = 0; ring + 1 < kRings; ++ring) {
      const unsigned a = ring * kAround + k, b = ring * kAround + next;
      triangles.push_back({a, b, b + kAround});
      triangles.push_back({a, b + kAround, a + kAround});
    }
  }
  const std::vector<hiprt::build::TriangleMesh> mesh{{positions, triangles}};
  return hiprt::build::build(mesh, {.builder = hiprt::build::Builder::kHploc, .nodes = hiprt::NodeLayout::kQuantized});
}

/// Two levels of instances of it, turned, stretched, and every other one moving.
hiprt::build::Result<hiprt::build::Bvh> make_scene(std::span<const std::byte> object, std::vector<Motion>& motions) {
  Random random{1};
  const auto number = [&](float most) { return most * random.unit(true); };
  motions.resize(4);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    motions[i].kind = static_cast<hiprt::MotionKind>(1 + i % 3);
    for (float time : {0.0f, 1.0f})
      motions[i].keys.push_back({.time = time,
                                 .translation = {number(3), number(3), number(3)},
                                 .rotation = {number(0.2f), number(0.2f), number(0.2f), 1}});
  }
  std::vector<Instance> inner(8), outer(3);
  for (std::size_t i = 0; i < inner.size(); ++i) {
    if (i % 2 == 0) inner[i].motion = &motions[i / 2];
    for (unsigned row = 0; row < 3; ++row) {
      inner[i].to_scene.row[row][3] = number(3);
      inner[i].to_scene.row[row][(row + 1) % 3] = 0.25f;
    }
  }
  for (unsigned i = 0; i < outer.size(); ++i) {
    outer[i].object = i == 2 ? 0 : 1;
    outer[i].to_scene.row[0][3] = 4.0f * static_cast<float>(i);
    outer[i].to_scene.row[1][1] = 1.5f;
  }
  const std::vector<std::span<const std::byte>> files{object};
  const std::vector<std::span<const Instance>> groups{inner, outer};
  return hiprt::build::build_instances(hiprt::build::InstancedScene{files, groups});
}

/// Spheres and curves around the origin in an object, and two instances of it.
hiprt::build::Result<hiprt::build::Bvh> make_shapes() {
  Random random{4};
  std::vector<hiprt::ShapePoint> balls(40), axis(60);
  for (std::vector<hiprt::ShapePoint>* points : {&balls, &axis})
    for (hiprt::ShapePoint& point : *points) {
      for (float& x : point.position) x = 2.0f * random.unit(false);
      point.radius = 0x1p-3f * (1.0f + random.unit(false));
    }
  const std::vector<std::uint32_t> strands(6, 10), segments = hiprt::build::strand_segments(strands);
  const hiprt::build::Shapes spheres{hiprt::ShapeKind::kSpheres, balls, {}};
  const hiprt::build::Shapes curves{hiprt::ShapeKind::kCurves, axis, segments};
  const auto sphere_boxes = hiprt::build::shape_boxes(spheres), curve_boxes = hiprt::build::shape_boxes(curves);
  const hiprt::build::CustomGeometry customs[] = {{.boxes = sphere_boxes.value(), .shapes = spheres},
                                                  {.boxes = curve_boxes.value(), .shapes = curves}};
  const auto object =
      hiprt::build::build(hiprt::build::SceneInput{.customs = customs}, {.nodes = hiprt::NodeLayout::kQuantized});
  if (!object) return tl::unexpected(object.error());
  std::vector<Instance> instances(2);
  instances[1].to_scene.row[0][3] = 3;
  instances[1].to_scene.row[1][2] = 0.5f;
  const std::vector<std::span<const std::byte>> files{object->buffer.bytes()};
  const std::vector<std::span<const Instance>> groups{instances};
  return hiprt::build::build_instances(hiprt::build::InstancedScene{files, groups});
}

template <unsigned kPart = 0>
gpu::Result<void> launch_parts(std::uint32_t parts, const Scenes& scenes, const Vec3* points, Results* results,
                               unsigned count) {
  if constexpr (kPart < kParts) {
    if ((parts >> kPart & 1u) != 0)
      if (auto done = gpu::launch(ask_all<kPart>, count, nullptr, {}, scenes, points, results, count); !done)
        return done;
    return launch_parts<kPart + 1>(parts, scenes, points, results, count);
  }
  return {};
}
template <unsigned kPart = 0>
void ask_host(std::uint32_t parts, const Scenes& scenes, const Vec3& point, float time, Results& results) {
  if constexpr (kPart < kParts) {
    if ((parts >> kPart & 1u) != 0) ask<kPart>(scenes, point, time, results);
    ask_host<kPart + 1>(parts, scenes, point, time, results);
  }
}

/// @param files of flat, deep and shapes.
gpu::Result<std::vector<Results>> on_device(std::uint32_t parts, const std::span<const std::byte> (&files)[3],
                                            std::span<const Vec3> points) {
  const hipStream_t stream = nullptr;
  gpu::DeviceAllocator allocator;
  const auto flat = gpu::upload_scene(files[0], stream, allocator);
  if (!flat) return tl::unexpected(flat.error());
  const auto deep = gpu::upload_scene(files[1], stream, allocator);
  if (!deep) return tl::unexpected(deep.error());
  const auto shapes = gpu::upload_scene(files[2], stream, allocator);
  if (!shapes) return tl::unexpected(shapes.error());
  const auto device_points = gpu::DeviceArray<Vec3>::from(points, stream, allocator);
  if (!device_points) return tl::unexpected(device_points.error());
  const std::vector<Results> empty(points.size());
  auto results = gpu::DeviceArray<Results>::from(empty, stream, allocator);
  if (!results) return tl::unexpected(results.error());
  const auto done = launch_parts(parts, {flat->view, deep->view, shapes->view}, device_points->data(), results->data(),
                                 static_cast<unsigned>(points.size()));
  if (!done) return tl::unexpected(done.error());
  return results->to_vector(stream);
}

}  // namespace

/// Arguments: the numbers of the queries (Part); none: all.
int main(int count, char** arguments) {
  std::uint32_t parts = count > 1 ? 0 : (1u << kParts) - 1;
  for (int i = 1; i < count; ++i) parts |= 1u << (static_cast<unsigned>(std::atoi(arguments[i])) % kParts);
  std::vector<Motion> motions;
  const auto object = make_object();
  if (!object) return std::fprintf(stderr, "%s\n", object.error().message.c_str()), 1;
  const auto scene = make_scene(object->buffer.bytes(), motions);
  if (!scene) return std::fprintf(stderr, "%s\n", scene.error().message.c_str()), 1;
  const auto shapes = make_shapes();
  if (!shapes) return std::fprintf(stderr, "%s\n", shapes.error().message.c_str()), 1;
  Random random{2};
  std::vector<Vec3> points(1024);
  for (Vec3& point : points) {
    const float size = random.power(2);
    const float x = random.unit(false), y = random.unit(false), z = random.unit(false);
    point = size * Vec3(x, y, z);
  }
  const auto results =
      on_device(parts, {object->buffer.bytes(), scene->buffer.bytes(), shapes->buffer.bytes()}, points);
  if (!results) return std::fprintf(stderr, "%s\n", results.error().message.c_str()), 1;
  const auto view_of = [](const hiprt::build::Bvh& bvh) {
    return hiprt::make_scene_view(*hiprt::open_buffer(bvh.buffer.bytes()));
  };
  const Scenes scenes{view_of(*object), view_of(*scene), view_of(*shapes)};
  unsigned some[kParts] = {}, different = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Results expected;
    ask_host(parts, scenes, points[i], 0.25f * static_cast<float>(i % 5), expected);
    some[kClosest] += expected.feature[0] != 0;
    some[kDeep] += expected.instance[1] != 0;
    some[kNearest] += expected.squared[5] != 0.0;
    some[kSigned] += expected.side == static_cast<std::uint32_t>(hiprt::Side::kInside);
    some[kBoxes] += expected.exact != 0;
    some[kDeepBoxes] += expected.boxes != 0;
    some[kShapes] += expected.geometry != 0;
    if (std::memcmp(&expected, &(*results)[i], sizeof(Results)) != 0 && ++different <= 3)
      std::fprintf(stderr, "point %zu: squared %.17g %.17g, on the host %.17g %.17g\n", i, (*results)[i].squared[0],
                   (*results)[i].squared[1], expected.squared[0], expected.squared[1]);
  }
  std::printf(
      "%zu points, queries %x: %u edges, %u inner instances, %u thirds, %u inside, %u and %u overlaps, %u curves; %u "
      "differ\n",
      points.size(), parts, some[0], some[1], some[2], some[3], some[4], some[5], some[6], different);
  for (unsigned part = 0; part < kParts; ++part)
    if ((parts >> part & 1u) != 0 && some[part] < 50) return std::fprintf(stderr, "too few to tell\n"), 1;
  return different == 0 ? 0 : 1;
}
