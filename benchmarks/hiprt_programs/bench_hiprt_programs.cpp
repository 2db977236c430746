/// What a program of HIPRT gets: kernels with HIPRT's names and libhiprt0300164.so, beside this library's own functions
/// for the same rays, trees and meshes.

#include "build_speed.h"
#include "trace_speed.h"

#include <benchmarks/common/flags.h>
#include <benchmarks/gpu_build/bench_data.h>
#include <hiprt_build/file.h>
#include <hiprt_build/gpu/device.h>
#include <tools/scene_io/mesh/mesh_formats.h>

#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>

namespace hiprt::bench {
namespace {

using build::Result;

struct Options {
  std::string json;
  unsigned width = 1920, height = 1080, repeats = 15, instances = 10000, batch = 20000;
};

struct Input {
  std::string name;
  tools::Mesh mesh;
  std::filesystem::path camera;  ///< Empty: chosen by the bounds.
};

/// SCENE.mesh, with SCENE.cam if there is one.
Result<Input> read_input(const std::filesystem::path& path) {
  const auto file = build::map_file(path.string());
  if (!file) return tl::unexpected(file.error());
  auto mesh = tools::read_raw_mesh(file->bytes());
  if (!mesh) return tl::unexpected(mesh.error());
  auto camera = path;
  camera.replace_extension(".cam");
  return Input{path.stem().string(), std::move(*mesh),
               std::filesystem::exists(camera) ? camera : std::filesystem::path()};
}

Result<tools::Camera> camera_of(const Input& input, const Box& bounds, double aspect) {
  if (input.camera.empty()) return tools::automatic_camera(bounds, aspect);
  std::ifstream stream(input.camera);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  const auto camera = tools::parse_camera(text);
  if (!camera) return gpu::fail(build::ErrorCode::kInvalidInput, input.camera.string(), ": ", camera.error());
  return *camera;
}

/// A scene with the geometry as its only instance.
Result<hiprtScene> scene_of_one(Library& library, hiprtGeometry geometry, hipStream_t stream) {
  gpu::DeviceAllocator allocator;
  hiprtInstance instance;
  instance.type = hiprtInstanceTypeGeometry;
  instance.geometry = geometry;
  auto instances = gpu::DeviceArray<hiprtInstance>::from({&instance, 1}, stream, allocator);
  if (!instances) return tl::unexpected(instances.error());
  hiprtSceneBuildInput input{};
  input.instances = instances->data();
  input.instanceCount = 1;
  auto scene = library.build(input, {hiprtBuildFlagBitPreferFastBuild, 0}, stream);
  if (auto done = gpu::check(hipStreamSynchronize(stream), "hipStreamSynchronize"); !done)
    return tl::unexpected(done.error());
  return scene;
}

Result<void> run_scene(Library& library, const Input& input, const Options& options, hipStream_t stream,
                       nlohmann::json& document) {
  gpu::DeviceAllocator allocator;
  auto mesh = DeviceMesh::make(input.mesh.positions, input.mesh.triangles, allocator);
  if (!mesh) return tl::unexpected(mesh.error());
  TracedScene scene{.name = input.name};
  const auto geometry = library.build(mesh->named(), {hiprtBuildFlagBitPreferHighQualityBuild, 0}, stream);
  if (!geometry) return tl::unexpected(geometry.error());
  scene.geometry = *geometry;
  const auto whole = scene_of_one(library, scene.geometry, stream);
  if (!whole) return tl::unexpected(whole.error());
  scene.scene = *whole;
  hiprtFloat3 lower, upper;
  auto done =
      check_hiprt(hiprtExportGeometryAabb(library.context(), scene.geometry, lower, upper), "hiprtExportGeometryAabb");
  if (!done) return done;
  const Box bounds{{lower.x, lower.y, lower.z}, {upper.x, upper.y, upper.z}};
  const auto camera = camera_of(input, bounds, static_cast<double>(options.width) / options.height);
  if (!camera) return tl::unexpected(camera.error());
  const auto rays = make_named_rays(scene.geometry, bounds, *camera, options.width, options.height, stream);
  if (!rays) return tl::unexpected(rays.error());
  const auto traces = time_traces(scene, *rays, options.repeats, stream, document["traces"]);
  if (!traces) return tl::unexpected(traces.error());
  const auto builds =
      time_builds(library, input.name, *mesh, options.instances, options.repeats, stream, document["builds"]);
  if (!builds) return tl::unexpected(builds.error());
  std::cout << *traces << *builds;
  return {};
}

Result<void> run_all(const Options& options, const std::vector<std::string>& paths, nlohmann::json& document) {
  const auto device = gpu::current_device();
  if (!device) return tl::unexpected(device.error());
  document["device"] = device->name;
  auto library = Library::make();
  if (!library) return tl::unexpected(library.error());
  hipStream_t stream = nullptr;
  if (auto made = gpu::check(hipStreamCreateWithFlags(&stream, hipStreamNonBlocking), "hipStreamCreateWithFlags");
      !made)
    return made;
  const auto kernels = describe_kernels(document["kernels"]);
  if (!kernels) return tl::unexpected(kernels.error());
  std::cout << *kernels;
  Result<void> done;
  if (paths.empty()) {
    const Ball ball = make_ball(40, 80);
    Input input{.name = "ball", .mesh = {}, .camera = {}};
    input.mesh.positions = ball.positions;
    input.mesh.triangles = ball.triangles;
    done = run_scene(**library, input, options, stream, document);
  }
  for (const std::string& path : paths) {
    const auto input = read_input(path);
    if (done && !input) done = gpu::fail(build::ErrorCode::kInvalidInput, path, ": ", input.error().message);
    if (done) done = run_scene(**library, *input, options, stream, document);
  }
  if (done && options.batch != 0) {
    const auto batch = time_batch(**library, options.batch, options.repeats, stream, document["builds"]);
    if (batch)
      std::cout << *batch;
    else
      done = tl::unexpected(batch.error());
  }
  library->reset();
  static_cast<void>(hipStreamDestroy(stream));
  return done;
}

int main(int argc, char** argv) {
  Options options;
  const std::vector<Flag> flags = {
      number_flag("width", "of the picture whose rays are traced (default 1920)", options.width, 1, 8192),
      number_flag("height", "likewise (default 1080)", options.height, 1, 8192),
      number_flag("repeats", "timed runs, after 3 others; the median counts (default 15)", options.repeats, 1, 1000),
      number_flag("instances", "of the scene that is built (default 10000)", options.instances, 1, 10000000),
      number_flag("batch", "meshes of the batch, 0: none (default 20000)", options.batch, 0, 10000000),
      text_flag("json", "FILE", "writes all figures as JSON", options.json)};
  const std::string fault = take_flags(argc, argv, flags);
  const std::vector<std::string> paths(argv + 1, argv + argc);
  const bool help = !paths.empty() && (paths[0] == "--help" || paths[0] == "-h");
  if (!fault.empty() || help) {
    (help ? std::cout : std::cerr) << (fault.empty() ? "" : "bench_hiprt_programs: " + fault + "\n")
                                   << "usage: bench_hiprt_programs [FLAG...] [SCENE.mesh...]\n"
                                   << describe(flags)
                                   << "Rays are of SCENE.cam, if it is there. Without a scene it takes a ball.\n";
    return help ? 0 : 2;
  }
  nlohmann::json document = {{"commit", HIPRT_BENCH_COMMIT},
                             {"repeats", options.repeats},
                             {"kernels", nlohmann::json::array()},
                             {"traces", nlohmann::json::array()},
                             {"builds", nlohmann::json::array()}};
  const auto done = run_all(options, paths, document);
  if (!done) {
    std::cerr << "bench_hiprt_programs: " << done.error().message << "\n";
    return 1;
  }
  if (options.json.empty()) return 0;
  std::ofstream file(options.json);
  file << document.dump(1) << "\n";
  if (file.good()) return 0;
  std::cerr << "bench_hiprt_programs: cannot write " << options.json << "\n";
  return 1;
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) { return hiprt::bench::main(argc, argv); }
