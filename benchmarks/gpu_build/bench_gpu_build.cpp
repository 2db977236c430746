/// Builders on the GPU: build time, quality and memory.

#include "builder_choice.h"
#include "instances.h"
#include "measured.h"
#include "mesh_builds.h"
#include "objects.h"
#include "overlapping.h"
#include "vulkan_builds.h"

#include <benchmarks/common/device_memory.h>
#include <benchmarks/common/flags.h>
#include <benchmarks/common/gpu_medians.h>
#include <benchmarks/common/markdown.h>
#include <hiprt_build/file.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/gpu/batch.h>
#include <hiprt_build/gpu/build.h>
#include <hiprt_build/gpu/device.h>
#include <hiprt_build/gpu/refit.h>
#include <hiprt_build/statistics.h>
#include <tools/scene_io/mesh/mesh_formats.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <utility>

namespace hiprt::bench {
namespace {

using build::Result;

struct Options {
  std::vector<std::string> builders{"lbvh", "lbvh30", "hploc"};
  std::vector<std::string> batches, instances, objects, overlapping;
  std::string json;
  unsigned pairs = 1, graphs = 0;
  MeshBench meshes;
  VulkanOptions vulkan;
};

Result<tools::Mesh> read_scene(const std::filesystem::path& path) {
  const auto file = build::map_file(path.string());
  if (!file) return tl::unexpected(file.error());
  return tools::read_raw_mesh(file->bytes());
}

/// Ribbons of triangles that do not overlap.
struct Ribbons {
  tools::Mesh mesh;
  std::vector<std::uint32_t> first{0};

  Ribbons(std::uint32_t count, std::uint32_t triangles) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto begin = static_cast<std::uint32_t>(mesh.positions.size());
      const std::uint32_t column = i % 1000, row = i / 1000;
      for (std::uint32_t k = 0; k < triangles + 2; ++k)
        mesh.positions.push_back({static_cast<float>(column) + 0.3f * std::sin(0.1f * static_cast<float>(k)),
                                  static_cast<float>(row) + 0.3f * std::cos(0.07f * static_cast<float>(k)),
                                  0.01f * static_cast<float>(k + 5 * (k & 1u))});
      for (std::uint32_t k = 0; k < triangles; ++k)
        mesh.triangles.push_back({begin + k, begin + k + 1 + (k & 1u), begin + k + 2 - (k & 1u)});
      first.push_back(static_cast<std::uint32_t>(mesh.triangles.size()));
    }
  }
};

struct MeasuredBatch {
  std::string builder;
  std::uint32_t meshes = 0, triangles = 0;
  double median_ms = 0;
};

Result<MeasuredBatch> measure_batch(std::uint32_t count, std::uint32_t triangles, const std::string& builder_name,
                                    const Options& options, hipStream_t stream) {
  const auto build_options = parse_builder(builder_name);
  if (!build_options) return tl::unexpected(build_options.error());
  const Ribbons ribbons(count, triangles);
  const auto scene = DeviceMesh::make("batch", ribbons.mesh.positions, ribbons.mesh.triangles);
  if (!scene) return tl::unexpected(scene.error());
  const auto first = gpu::DeviceArray<std::uint32_t>::from(ribbons.first, stream, device_memory());
  if (!first) return tl::unexpected(first.error());
  const gpu::DeviceGeometry all = scene->geometry();
  const gpu::DeviceBatch batch{all.positions, all.triangles, all.position_count, ribbons.first, first->data()};
  const auto sizes = gpu::batch_sizes(batch, *build_options);
  if (!sizes) return tl::unexpected(sizes.error());
  auto output = gpu::DeviceBuffer::make(sizes->output, stream, device_memory());
  if (!output) return tl::unexpected(output.error());
  auto scratch = gpu::DeviceBuffer::make(sizes->scratch, stream, device_memory());
  if (!scratch) return tl::unexpected(scratch.error());
  const auto median = median_of(options.meshes.repeats, stream, [&] {
    return gpu::enqueue_batch(batch, *build_options, output->data(), scratch->data(), stream);
  });
  if (!median) return tl::unexpected(median.error());
  return MeasuredBatch{builder_name, count, triangles, *median};
}

/// Parses "20000x224". @return false for other texts.
bool parse_batch(const std::string& text, std::uint32_t& count, std::uint32_t& triangles) {
  char end = 0;
  return std::sscanf(text.c_str(), "%ux%u%c", &count, &triangles, &end) == 2 && count > 0 && triangles > 0 &&
         std::uint64_t{count} * triangles < gpu::kMaxBuildPrimitives;
}

/// Prints a table. @return false after an error.
bool run_batches(const Options& options, hipStream_t stream, nlohmann::json& results) {
  MarkdownTable table({"batch", "builder", "ms", "Mtri/s"});
  bool good = true;
  for (const std::string& text : options.batches)
    for (const std::string& builder : options.builders) {
      std::uint32_t count = 0, triangles = 0;
      if (builder != "lbvh" && builder != "hploc") continue;
      const auto measured = parse_batch(text, count, triangles)
                                ? measure_batch(count, triangles, builder, options, stream)
                                : gpu::fail(build::ErrorCode::kInvalidInput, "not MESHESxTRIANGLES");
      if (!measured) {
        std::cerr << "bench_gpu_build: batch " << text << ": " << measured.error().message << "\n";
        good = false;
        continue;
      }
      const double rate = double{1} * count * triangles / measured->median_ms / 1e3;
      table.add({text, builder, format_number(measured->median_ms, 3), format_number(rate, 0)});
      results.push_back({{"meshes", count},
                         {"triangles", triangles},
                         {"builder", builder},
                         {"median_ms", measured->median_ms},
                         {"mtri_s", rate}});
    }
  if (!options.batches.empty()) std::cout << table.text();
  return good;
}

/// Vulkan, with and without compaction: a row each. @return false after an error, which is printed.
bool run_vulkan(VulkanMachine& machine, const Options& options, const std::string& scene, const tools::Mesh& mesh,
                std::vector<Measured>& all) {
  bool good = true;
  const build::TriangleMesh input{.positions = mesh.positions, .triangles = mesh.triangles};
  for (const std::string& mode : options.vulkan.modes)
    for (const bool compacted : {false, true}) {
      const auto builds = measure_vulkan(machine, input, mode, compacted, options.meshes.repeats);
      if (builds)
        all.push_back(row_of(scene, mesh.triangles.size(), mode, *builds));
      else
        std::cerr << "bench_gpu_build: " << scene << ", Vulkan, " << mode << ": " << builds.error().message << "\n";
      good = good && builds;
    }
  return good;
}

/// Prints a table. @return false after an error.
bool run_scenes(const Options& options, const std::vector<std::string>& paths, hipStream_t stream,
                VulkanMachine* vulkan, nlohmann::json& results) {
  std::vector<Measured> all;
  bool good = true;
  for (const std::string& path : paths) {
    const auto mesh = read_scene(path);
    const auto scene =
        mesh ? DeviceMesh::make(std::filesystem::path(path).stem().string(), mesh->positions, mesh->triangles)
             : tl::unexpected(mesh.error());
    for (const std::string& builder : options.builders) {
      const auto measured = scene ? measure(*scene, builder, options.meshes, stream) : tl::unexpected(scene.error());
      if (!measured) {
        std::cerr << "bench_gpu_build: " << path << ", " << builder << ": " << measured.error().message << "\n";
        good = false;
        continue;
      }
      all.push_back(*measured);
    }
    if (vulkan != nullptr && scene) good = run_vulkan(*vulkan, options, scene->name, *mesh, all) && good;
  }
  for (const Measured& measured : all) results.push_back(to_json(measured));
  if (!all.empty()) std::cout << table(all);
  return good;
}

/// Opens Vulkan's device, for scenes only. @return nullptr if Vulkan is not measured; a reason is printed.
std::shared_ptr<VulkanMachine> open_for(Options& options, const std::vector<std::string>& paths) {
  if (paths.empty()) return nullptr;
  auto machine = open_chosen(options.vulkan, true);
  if (machine) return std::move(*machine);
  std::cerr << "bench_gpu_build: Vulkan is not measured: " << machine.error().message << "\n";
  return nullptr;
}

int run(Options& options, const std::vector<std::string>& paths) {
  hipStream_t stream = nullptr;
  const auto device = gpu::current_device();
  if (!device || hipStreamCreateWithFlags(&stream, hipStreamNonBlocking) != hipSuccess) {
    std::cerr << "bench_gpu_build: " << (device ? "no stream" : device.error().message) << "\n";
    return 1;
  }
  const auto none = nlohmann::json::array();
  nlohmann::json results = none, batches = none, instances = none, objects = none, overlapping = none;
  const std::shared_ptr<VulkanMachine> vulkan = open_for(options, paths);
  bool good = run_scenes(options, paths, stream, vulkan.get(), results);
  good = run_batches(options, stream, batches) && good;
  const InstanceBench bench{options.instances, options.builders, options.meshes.repeats, options.graphs != 0};
  good = run_instances(bench, stream, instances) && good;
  good = run_objects({options.objects, options.meshes.repeats}, stream, objects) && good;
  good = run_overlapping({options.overlapping, options.builders, options.meshes}, stream, overlapping) && good;
  if (!options.json.empty()) {
    const nlohmann::json document = {{"vulkan", vulkan == nullptr ? nlohmann::json() : vulkan->describe()},
                                     {"device", device->name},
                                     {"commit", HIPRT_BENCH_COMMIT},
                                     {"repeats", options.meshes.repeats},
                                     {"results", results},
                                     {"batches", batches},
                                     {"instances", instances},
                                     {"objects", objects},
                                     {"overlapping", overlapping}};
    std::ofstream file(options.json);
    file << document.dump(1) << "\n";
    good = good && file.good();
  }
  static_cast<void>(hipStreamDestroy(stream));
  return good ? 0 : 1;
}

int main(int argc, char** argv) {
  Options options;
  std::vector<Flag> flags = {
      list_flag("builders", "NAME[:split=X][:presplit=X][:rounds=N][:radius=N],...",
                "builders and their options (default lbvh,lbvh30,hploc)", options.builders),
      list_flag("batches", "MESHESxTRIANGLES,...", "batches of ribbons, e.g. 20000x224", options.batches),
      list_flag("instances", "COUNT,...", "BVHs over this number of instances of one object, e.g. 10000",
                options.instances),
      list_flag("objects", "COUNT,...", "scenes of this number of objects, all built on the device, e.g. 10000",
                options.objects),
      list_flag("overlapping", "COUNT,...",
                "generated meshes of so many triangles that overlap, beside as many that do not, e.g. 1000000",
                options.overlapping),
      number_flag("graphs", "1: measures captured graphs too, 0: not (default)", options.graphs, 0, 1),
      number_flag("repeats", "timed builds, after 3 others; the median counts (default 15)", options.meshes.repeats, 1,
                  1000),
      number_flag("pairs", "1: leaves with pairs of triangles (default), 0: single triangles", options.pairs, 0, 1),
      text_flag("nodes", "NAME", "float, planes (default), half or quantized", options.meshes.nodes),
      text_flag("json", "FILE", "writes all figures as JSON", options.json),
      text_flag("save", "FOLDER", "writes the BVHs to SCENE.BUILDER.bvh", options.meshes.save)};
  for (Flag& flag : options.vulkan.flags()) flags.push_back(std::move(flag));
  const std::string fault = take_flags(argc, argv, flags);
  const std::vector<std::string> paths(argv + 1, argv + argc);
  const bool help = !paths.empty() && (paths[0] == "--help" || paths[0] == "-h");
  if (!fault.empty() || help ||
      (paths.empty() && options.batches.empty() && options.instances.empty() && options.objects.empty() &&
       options.overlapping.empty())) {
    (help ? std::cout : std::cerr) << (fault.empty() ? "" : "bench_gpu_build: " + fault + "\n")
                                   << "usage: bench_gpu_build [FLAG...] SCENE.mesh...\n"
                                   << describe(flags);
    return help ? 0 : 2;
  }
  options.meshes.pairs = options.pairs != 0;
  return run(options, paths);
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) { return hiprt::bench::main(argc, argv); }
