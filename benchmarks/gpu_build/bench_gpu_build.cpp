/// Builders on the GPU: build times, quality and memory. It needs no library that a GPU machine lacks.

#include <benchmarks/common/flags.h>
#include <benchmarks/common/markdown.h>
#include <hiprt_build/file.h>
#include <hiprt_build/gpu/build.h>
#include <hiprt_build/gpu/device.h>
#include <hiprt_build/gpu/event.h>
#include <hiprt_build/statistics.h>
#include <hiprt_device/format/validate.h>
#include <tools/mesh_formats.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>

namespace hiprt::bench {
namespace {

using build::Builder;
using build::Result;

struct Options {
  std::vector<std::string> builders{"lbvh", "lbvh30", "hploc"};
  std::string json, save;
  unsigned repeats = 15, pairs = 1;
};

struct Measured {
  std::string scene, builder;
  std::uint64_t triangles = 0, output_bytes = 0, scratch_bytes = 0, file_bytes = 0;
  double min_ms = 0, median_ms = 0, max_ms = 0, sah_cost = 0;
  gpu::BuildReport report{};
};

Result<Builder> find_builder(const std::string& name) {
  for (const Builder builder : {Builder::kLbvh, Builder::kLbvh30, Builder::kHploc})
    if (name == build::name(builder)) return builder;
  return gpu::fail(build::ErrorCode::kInvalidInput, "no builder '", name, "'; there are lbvh, lbvh30, hploc");
}

Result<tools::Mesh> read_scene(const std::filesystem::path& path) {
  const auto file = build::map_file(path.string());
  if (!file) return tl::unexpected(file.error());
  return tools::read_raw_mesh(file->bytes());
}

/// One scene on the device.
class Scene {
 public:
  static Result<Scene> make(std::string name, const tools::Mesh& mesh) {
    Scene scene;
    scene.name = std::move(name);
    auto positions = gpu::DeviceArray<build::Position>::from(mesh.positions, nullptr, allocator());
    if (!positions) return tl::unexpected(positions.error());
    auto triangles = gpu::DeviceArray<build::Triangle>::from(mesh.triangles, nullptr, allocator());
    if (!triangles) return tl::unexpected(triangles.error());
    scene.positions_ = std::move(*positions);
    scene.triangles_ = std::move(*triangles);
    if (auto done = gpu::check(hipDeviceSynchronize(), "hipDeviceSynchronize"); !done)
      return tl::unexpected(done.error());
    return scene;
  }
  static gpu::Allocator& allocator() {
    static gpu::DeviceAllocator device;
    return device;
  }
  gpu::DeviceGeometry geometry() const {
    return {.positions = positions_.data(),
            .triangles = triangles_.data(),
            .position_count = static_cast<std::uint32_t>(positions_.size()),
            .primitive_count = static_cast<std::uint32_t>(triangles_.size())};
  }

  std::string name;

 private:
  gpu::DeviceArray<build::Position> positions_;
  gpu::DeviceArray<build::Triangle> triangles_;
};

Result<void> time_builds(const Scene& scene, const gpu::BuildOptions& options, unsigned repeats, std::byte* output,
                         std::byte* scratch, hipStream_t stream, std::vector<double>& milliseconds) {
  const gpu::DeviceGeometry geometry = scene.geometry();
  auto watch = gpu::Stopwatch::make();
  if (!watch) return tl::unexpected(watch.error());
  for (unsigned i = 0; i < repeats + 3; ++i) {
    auto done = watch->start(stream);
    if (!done) return done;
    const auto report = gpu::enqueue_build({&geometry, 1}, options, output, scratch, stream);
    if (!report) return tl::unexpected(report.error());
    done = watch->stop(stream);
    if (!done) return done;
    const auto took = watch->milliseconds();
    if (!took) return tl::unexpected(took.error());
    if (i >= 3) milliseconds.push_back(double{*took});
  }
  std::sort(milliseconds.begin(), milliseconds.end());
  return {};
}

/// Downloads, validates and measures the tree.
Result<void> judge(const Scene& scene, const gpu::BuildReport* report, const std::string& save, hipStream_t stream,
                   Measured& measured) {
  const auto built = gpu::compact(report, stream, Scene::allocator());
  if (!built) return tl::unexpected(built.error());
  measured.report = built->report;
  const auto file = gpu::download_file(*built, "bench_gpu_build", stream);
  if (!file) return tl::unexpected(file.error());
  measured.file_bytes = file->size();
  const auto summary = validate(file->bytes());
  if (!summary) return gpu::fail(build::ErrorCode::kBackend, "not a valid tree: ", to_string(summary.error()));
  measured.sah_cost = build::measure_tree(*open_buffer(file->bytes())).sah_cost;
  if (save.empty()) return {};
  return build::write_file(save + "/" + scene.name + "." + measured.builder + ".bvh", file->bytes());
}

Result<Measured> measure(const Scene& scene, const std::string& builder_name, const Options& options,
                         hipStream_t stream) {
  const auto builder = find_builder(builder_name);
  if (!builder) return tl::unexpected(builder.error());
  const gpu::BuildOptions build_options{.builder = *builder, .pair_triangles = options.pairs != 0};
  const gpu::DeviceGeometry geometry = scene.geometry();
  const auto sizes = gpu::build_sizes({&geometry, 1}, build_options);
  if (!sizes) return tl::unexpected(sizes.error());
  auto output = gpu::DeviceBuffer::make(sizes->output, stream, Scene::allocator());
  if (!output) return tl::unexpected(output.error());
  auto scratch = gpu::DeviceBuffer::make(sizes->scratch, stream, Scene::allocator());
  if (!scratch) return tl::unexpected(scratch.error());
  std::vector<double> times;
  if (auto timed = time_builds(scene, build_options, options.repeats, output->data(), scratch->data(), stream, times);
      !timed)
    return tl::unexpected(timed.error());
  Measured result{.scene = scene.name,
                  .builder = builder_name,
                  .triangles = geometry.primitive_count,
                  .output_bytes = sizes->output,
                  .scratch_bytes = sizes->scratch,
                  .min_ms = times.front(),
                  .median_ms = times[times.size() / 2],
                  .max_ms = times.back()};
  // Poisoned: every byte of the tree is written by the build.
  auto done = output->fill(std::byte{0xa5}, stream);
  if (done) done = scratch->fill(std::byte{0xa5}, stream);
  if (!done) return tl::unexpected(done.error());
  const auto report = gpu::enqueue_build({&geometry, 1}, build_options, output->data(), scratch->data(), stream);
  if (!report) return tl::unexpected(report.error());
  if (auto judged = judge(scene, *report, options.save, stream, result); !judged) return tl::unexpected(judged.error());
  return result;
}

nlohmann::json to_json(const Measured& m) {
  return {{"scene", m.scene},
          {"builder", m.builder},
          {"triangles", m.triangles},
          {"min_ms", m.min_ms},
          {"median_ms", m.median_ms},
          {"max_ms", m.max_ms},
          {"mtri_s", static_cast<double>(m.triangles) / m.median_ms / 1e3},
          {"sah_cost", m.sah_cost},
          {"pairs", m.report.pairs},
          {"leaves", m.report.leaves},
          {"nodes", m.report.nodes},
          {"output_bytes", m.output_bytes},
          {"scratch_bytes", m.scratch_bytes},
          {"file_bytes", m.file_bytes}};
}

std::string table(const std::vector<Measured>& all) {
  MarkdownTable result({"scene", "builder", "triangles", "ms", "Mtri/s", "SAH cost", "pairs / triangle", "nodes / leaf",
                        "B/tri file", "B/tri output", "B/tri scratch"});
  for (const Measured& m : all) {
    const auto per_triangle = [&](std::uint64_t count) {
      return format_number(static_cast<double>(count) / static_cast<double>(m.triangles), 2);
    };
    result.add({m.scene, m.builder, std::to_string(m.triangles), format_number(m.median_ms, 3),
                format_number(static_cast<double>(m.triangles) / m.median_ms / 1e3, 0), format_number(m.sah_cost, 3),
                per_triangle(m.report.pairs),
                format_number(double{1} * m.report.nodes / std::max(1u, m.report.leaves), 3),
                per_triangle(m.file_bytes), per_triangle(m.output_bytes), per_triangle(m.scratch_bytes)});
  }
  return result.text();
}

int run(const Options& options, const std::vector<std::string>& paths) {
  hipStream_t stream = nullptr;
  const auto device = gpu::current_device();
  if (!device || hipStreamCreateWithFlags(&stream, hipStreamNonBlocking) != hipSuccess) {
    std::cerr << "bench_gpu_build: " << (device ? "no stream" : device.error().message) << "\n";
    return 1;
  }
  std::vector<Measured> all;
  nlohmann::json results = nlohmann::json::array();
  bool good = true;
  for (const std::string& path : paths) {
    const auto mesh = read_scene(path);
    const auto scene =
        mesh ? Scene::make(std::filesystem::path(path).stem().string(), *mesh) : tl::unexpected(mesh.error());
    for (const std::string& builder : options.builders) {
      const auto measured = scene ? measure(*scene, builder, options, stream) : tl::unexpected(scene.error());
      if (!measured) {
        std::cerr << "bench_gpu_build: " << path << ", " << builder << ": " << measured.error().message << "\n";
        good = false;
        continue;
      }
      all.push_back(*measured);
      results.push_back(to_json(*measured));
    }
  }
  std::cout << table(all);
  if (!options.json.empty()) {
    const nlohmann::json document = {
        {"device", device->name}, {"commit", HIPRT_BENCH_COMMIT}, {"repeats", options.repeats}, {"results", results}};
    std::ofstream file(options.json);
    file << document.dump(1) << "\n";
    good = good && file.good();
  }
  static_cast<void>(hipStreamDestroy(stream));
  return good ? 0 : 1;
}

int main(int argc, char** argv) {
  Options options;
  const std::vector<Flag> flags = {
      list_flag("builders", "NAME,...", "builders (default lbvh,lbvh30,hploc)", options.builders),
      number_flag("repeats", "builds of which the median is taken, after 3 others (default 15)", options.repeats, 1,
                  1000),
      number_flag("pairs", "1: pairs of triangles (default), 0: none", options.pairs, 0, 1),
      text_flag("json", "FILE", "writes everything that was measured", options.json),
      text_flag("save", "FOLDER", "writes the trees to SCENE.BUILDER.bvh", options.save)};
  const std::string fault = take_flags(argc, argv, flags);
  const std::vector<std::string> paths(argv + 1, argv + argc);
  if (!fault.empty() || paths.empty() || paths[0] == "--help" || paths[0] == "-h") {
    const bool help = fault.empty() && !paths.empty();
    (help ? std::cout : std::cerr) << (fault.empty() ? "" : "bench_gpu_build: " + fault + "\n")
                                   << "usage: bench_gpu_build [FLAG...] SCENE.mesh...\n"
                                   << describe(flags);
    return help ? 0 : 2;
  }
  return run(options, paths);
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) { return hiprt::bench::main(argc, argv); }
