// The scenes of the test on GPUs, and the same program on the host.

// nvcc makes host functions of the program's device functions.
#define intersectFunc intersect_on_host
#define filterFunc filter_on_host

#include <hiprt_build/build.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/open_scene.h>
#include <tests/compat/gpu/program.h>
#include <tests/compat/types.h>
#include <tests/oracle/random.h>

#include <cstdlib>

namespace hiprt::test {

namespace {

constexpr unsigned kTriangles = 300, kSquares = 200;

template <class Built> build::Bvh checked(Built&& built) {
  if (!built) std::abort();
  return std::move(*built);
}

}  // namespace

TraceInput make_input() {
  oracle::Random random(20261129);
  std::vector<build::Position> positions;
  std::vector<build::Triangle> triangles;
  for (std::uint32_t i = 0; i < kTriangles; ++i) {
    const auto at = random.in_cube(1.0);
    for (unsigned corner = 0; corner < 3; ++corner) {
      const auto to = random.in_cube(0.5);
      positions.push_back({at[0] + to[0], at[1] + to[1], at[2] + to[2]});
    }
    triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  std::vector<Box> boxes;
  std::vector<float> centers;
  for (unsigned i = 0; i < kSquares; ++i) {
    const auto c = random.in_cube(1.0);
    centers.insert(centers.end(), c.begin(), c.end());
    boxes.push_back({{c[0] - kSize, c[1] - kSize, c[2] - kSize}, {c[0] + kSize, c[1] + kSize, c[2] + kSize}});
  }
  const build::TriangleMesh mesh{positions, triangles};
  // Types are geomType + 1.
  const build::CustomGeometry custom{.boxes = boxes, .type = 1};
  build::Bvh of_mesh = checked(build::build(std::span(&mesh, 1)));
  build::Bvh of_squares = checked(build::build(build::SceneInput{{}, std::span(&custom, 1)}));
  const std::vector<std::span<const std::byte>> files{of_mesh.buffer.bytes(), of_squares.buffer.bytes()};
  std::vector<build::Motion> motions(4);
  std::vector<build::Instance> inner, outer;
  for (std::uint32_t i = 0; i < 8; ++i) {
    const auto at = random.in_cube(1.0);
    build::Instance instance{.object = i % 2};
    instance.to_scene.row[0][1] = random.uniform_float(-0.5, 0.5);
    for (unsigned row = 0; row < 3; ++row) instance.to_scene.row[row][3] = at[row];
    if (i >= 4) {
      motions[i - 4].matrices = {{0.0f, instance.to_scene}, {1.0f, instance.to_scene}};
      motions[i - 4].matrices[1].to_scene.row[2][3] += 0.5f;
      instance.motion = &motions[i - 4];
    }
    inner.push_back(instance);
    instance.object = i < 6 ? 2u : i % 2;
    outer.push_back(instance);
  }
  const std::vector<std::span<const build::Instance>> groups{inner, outer};
  build::Bvh of_scene = checked(build::build_instances(build::InstancedScene{files, groups}));
  TraceInput input{std::move(of_mesh.buffer), std::move(of_squares.buffer), std::move(of_scene.buffer), {}, centers};
  for (unsigned i = 0; i < 256; ++i) {
    const auto from = random.in_cube(2.0), to = random.in_cube(0.5);
    TraceRay ray{{from[0], from[1], from[2]}, {}, 0.0f, 3.402823466e+38f, random.uniform_float(0, 1)};
    for (unsigned axis = 0; axis < 3; ++axis) ray.direction[axis] = to[axis] - from[axis];
    if (i % 4 == 1) ray.max_t = random.uniform_float(0, 2);
    if (i % 4 == 2) ray.min_t = random.uniform_float(0, 2);
    input.rays.push_back(ray);
  }
  return input;
}

std::vector<TraceResult> trace_on_host(const TraceInput& input) {
  const auto open = [](const build::Buffer& buffer) {
    auto file = open_scene(buffer.bytes());
    if (!file) std::abort();
    return std::move(*file);
  };
  const SceneFile mesh = open(input.mesh), squares = open(input.squares), scene = open(input.scene);
  const SceneView mesh_view = mesh.scene(), square_view = squares.scene(), scene_view = scene.scene();
  const SquareData square{kSize};
  hiprtFuncDataSet sets[2] = {{&square, &kFilterLimit}, {nullptr, &kFilterLimit}};
  hiprtFuncTableHeader table{2, 1, sets};
  std::vector<float> centers = input.centers;
  std::vector<TraceResult> results(input.rays.size() * kResultsPerRay);
  const Launch launch{geometry_handle(&mesh_view),
                      geometry_handle(&square_view),
                      scene_handle(&scene_view),
                      &table,
                      centers.data(),
                      input.rays.data(),
                      results.data(),
                      static_cast<std::uint32_t>(input.rays.size())};
  hiprtPrivateStack stack;
  hiprtPrivateInstanceStack instance_stack;
  for (std::uint32_t i = 0; i < launch.count; ++i) traceRay(launch, i, stack, instance_stack);
  return results;
}

}  // namespace hiprt::test
