// Arrays with gaps, implicit triangles, given pairs and float4 boxes on the device: the same files as on the host.

#include <tests/gpu/builders/build_input.h>
#include <tests/oracle/odd_meshes.h>

using namespace hiprt;
using namespace hiprt::checks;
using Catch::Matchers::Contains;

namespace {

struct Vertex {
  float before = 1e30f;
  build::Position position;
  float behind[3] = {-1e30f, 1e30f, 1e30f};
};
struct Face {
  build::Triangle corners;
  std::uint32_t material = 0xffffffffu;
};
struct Float4Box {
  float min[4], max[4];
};

template <class T> gpu::DeviceArray<T> upload(const std::vector<T>& values, gpu::Allocator& allocator) {
  return must(gpu::DeviceArray<T>::from(values, nullptr, allocator));
}

build::Buffer build_file(const gpu::DeviceGeometry& geometry, const gpu::BuildOptions& options,
                         gpu::Allocator& allocator, gpu::BuildReport* report = nullptr) {
  const gpu::BuiltScene scene = must(gpu::build_scene({&geometry, 1}, options, nullptr, allocator));
  if (report != nullptr) *report = scene.report;
  build::Buffer file = must(gpu::download_file(scene, "test_arrays", nullptr));
  checked_view(file);
  return file;
}

}  // namespace

TEST_CASE("pairs that are given, and arrays with gaps, make the host's trees") {
  INFO("seed " << kSeed);
  CountingAllocator allocator;
  const oracle::Mesh mesh = oracle::icosphere(2);
  std::vector<Vertex> vertices;
  for (const build::Position& position : mesh.positions) vertices.push_back({.position = position});
  std::vector<Face> faces;
  for (const build::Triangle& triangle : mesh.triangles) faces.push_back({triangle});
  const auto device_vertices = upload(vertices, allocator);
  const auto device_faces = upload(faces, allocator);
  // Neighbours in the list, some with a common edge. The device must ignore the last two pairs.
  std::vector<build::TrianglePair> pairs;
  for (std::uint32_t i = 0; i + 1 < mesh.triangles.size(); i += 2) pairs.push_back({i + 1, i});
  const build::TriangleMesh view{
      .positions = mesh.positions, .triangles = mesh.triangles, .type = 70000, .pairs = pairs};
  pairs.push_back({0, 5});
  pairs.push_back({2, 4000000000u});
  const auto device_pairs = upload(pairs, allocator);
  REQUIRE(hipDeviceSynchronize() == hipSuccess);
  gpu::DeviceGeometry geometry{.positions = reinterpret_cast<const build::Position*>(&device_vertices.data()->position),
                               .triangles = &device_faces.data()->corners,
                               .position_count = static_cast<std::uint32_t>(vertices.size()),
                               .primitive_count = static_cast<std::uint32_t>(faces.size()),
                               .type = 70000,
                               .position_stride = sizeof(Vertex),
                               .triangle_stride = sizeof(Face),
                               .pairs = device_pairs.data(),
                               .pair_count = static_cast<std::uint32_t>(pairs.size())};
  const build::TriangleMesh host_view{
      view.positions, view.triangles, view.mask, view.name, view.type, false, std::span(pairs).first(pairs.size() - 2)};
  gpu::BuildReport report;
  const build::Buffer device = build_file(geometry, {.builder = build::Builder::kHploc}, allocator, &report);
  const build::Bvh host =
      must(build::build(build::SceneInput{.meshes = {&host_view, 1}}, {.builder = build::Builder::kHploc}));
  CHECK(report.pairs == host.statistics.pairs);
  CHECK(report.pairs > 10);
  check_same_files(device, host.buffer);
  CHECK(geometry_type(open_buffer(device.bytes())->geometries[0].flags) == 70000);
}

TEST_CASE("small scenes of implicit triangles and of float4 boxes") {
  INFO("seed " << kSeed);
  CountingAllocator allocator;
  const oracle::Mesh mesh = oracle::soup(200, 0.2, kSeed);
  const auto positions = upload(mesh.positions, allocator);
  REQUIRE(hipDeviceSynchronize() == hipSuccess);
  // A soup's triangles have corners of their own, in order.
  gpu::DeviceGeometry implicit{.positions = positions.data(),
                               .position_count = static_cast<std::uint32_t>(mesh.positions.size()),
                               .primitive_count = 200,
                               .implicit_triangles = true};
  const build::TriangleMesh host_mesh{.positions = mesh.positions, .implicit_triangles = true};
  check_same_files(build_file(implicit, {.pair_triangles = false}, allocator),
                   must(build::build(build::SceneInput{.meshes = {&host_mesh, 1}},
                                     {.builder = build::Builder::kHploc, .pair_triangles = false}))
                       .buffer);
  const auto message = [&](const gpu::DeviceGeometry& geometry) {
    return error_of(gpu::build_sizes({&geometry, 1})).message;
  };
  implicit.position_count = 599;
  CHECK(message(implicit) == "geometry 0: 200 implicit triangles need three times as many positions, not 599");
  implicit.implicit_triangles = false;
  CHECK_THAT(message(implicit), Contains("positions with implicit_triangles"));
  implicit.primitive_count = 0;
  CHECK(message(implicit) == "geometry 0: 599 positions but no triangles; give triangles, or set implicit_triangles");

  std::vector<Float4Box> boxes;
  std::vector<Box> packed;
  for (unsigned i = 0; i < 100; ++i) {
    const auto& p = mesh.positions[i];
    packed.push_back({{p[0], p[1], p[2]}, {p[0] + 1, p[1] + 1, p[2] + 1}});
    boxes.push_back({{p[0], p[1], p[2], 1e30f}, {p[0] + 1, p[1] + 1, p[2] + 1, -1e30f}});
  }
  const auto device_boxes = upload(boxes, allocator);
  REQUIRE(hipDeviceSynchronize() == hipSuccess);
  gpu::DeviceGeometry customs{.boxes = reinterpret_cast<const Box*>(device_boxes.data()),
                              .primitive_count = 100,
                              .type = 3,
                              .box_stride = 32,
                              .box_upper = 16};
  const build::CustomGeometry host_boxes{.boxes = packed, .type = 3};
  check_same_files(
      build_file(customs, {}, allocator),
      must(build::build(build::SceneInput{.customs = {&host_boxes, 1}}, {.builder = build::Builder::kHploc})).buffer);
  customs.box_upper = 24;
  CHECK_THAT(message(customs), Contains("geometry 0: box_upper of 24 bytes"));
  customs.box_upper = 12;
  customs.type = kMaxGeometryType + 1;
  CHECK_THAT(message(customs), Contains("type 16777216, the limit is 16777215"));
}
