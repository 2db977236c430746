#include "instances.h"

#include "bench_data.h"
#include "builder_choice.h"

#include <benchmarks/common/device_memory.h>
#include <benchmarks/common/gpu_medians.h>
#include <benchmarks/common/markdown.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/gpu/instances.h>
#include <hiprt_build/statistics.h>

#include <nlohmann/json.hpp>

#include <iostream>

namespace hiprt::bench {
namespace {

using build::InstanceBounds;
using build::Result;

/// A scene with one instance of a ball of 1600 triangles.
Result<build::Bvh> ball() {
  const Ball mesh = make_ball(20, 40);
  const build::TriangleMesh meshes[] = {{mesh.positions, mesh.triangles}};
  auto object = build::build(meshes);
  if (!object) return object;
  const std::span<const std::byte> files[] = {object->buffer.bytes()};
  const build::Instance one[] = {{.object = 0}};
  return build::build_instances(files, one);
}

/// Time of a graph that is captured from work().
template <class Work> Result<double> median_of_graph(unsigned repeats, hipStream_t stream, const Work& work) {
  hipGraph_t graph = nullptr;
  hipGraphExec_t ready = nullptr;
  auto done = gpu::check(hipStreamBeginCapture(stream, hipStreamCaptureModeGlobal), "hipStreamBeginCapture");
  if (!done) return tl::unexpected(std::move(done.error()));
  const auto enqueued = work();
  done = gpu::check(hipStreamEndCapture(stream, &graph), "hipStreamEndCapture");
  if (!enqueued) return tl::unexpected(enqueued.error());
  if (done) done = gpu::check(hipGraphInstantiateWithFlags(&ready, graph, 0), "hipGraphInstantiateWithFlags");
  if (!done) return tl::unexpected(std::move(done.error()));
  auto median = median_of(repeats, stream, [&] { return gpu::check(hipGraphLaunch(ready, stream), "hipGraphLaunch"); });
  static_cast<void>(hipGraphExecDestroy(ready));
  static_cast<void>(hipGraphDestroy(graph));
  return median;
}

struct MeasuredInstances {
  gpu::BuildSizes sizes;
  double median_ms = 0, graph_ms = 0, sah_cost = 0;
};

/// Device memory for one build.
struct Prepared {
  gpu::DeviceScene scene;
  gpu::SceneObjects objects;
  gpu::DeviceArray<gpu::DeviceInstance> instances;
  gpu::DeviceBuffer scratch;
  gpu::BuildSizes sizes;

  static Result<Prepared> make(const BufferView& view, std::uint32_t count, const gpu::InstanceOptions& options,
                               hipStream_t stream) {
    const auto sizes = gpu::instance_sizes(gpu::objects_in(view), count, options);
    if (!sizes) return tl::unexpected(sizes.error());
    auto scene = gpu::upload_scene(view, stream, device_memory(), sizes->output);
    if (!scene) return tl::unexpected(scene.error());
    auto instances = gpu::DeviceArray<gpu::DeviceInstance>::from(make_instances(count), stream, device_memory());
    if (!instances) return tl::unexpected(instances.error());
    auto scratch = gpu::DeviceBuffer::make(sizes->scratch, stream, device_memory());
    if (!scratch) return tl::unexpected(scratch.error());
    if (auto passed = gpu::check(hipStreamSynchronize(stream), "hipStreamSynchronize"); !passed)
      return tl::unexpected(std::move(passed.error()));
    const gpu::SceneObjects objects = gpu::objects_of(*scene, view);
    return Prepared{std::move(*scene), objects, std::move(*instances), std::move(*scratch), *sizes};
  }
};

/// Downloads and validates the result of the last build.
Result<double> judge(const gpu::InstanceReport* report, const gpu::SceneObjects& objects, hipStream_t stream) {
  const auto read = gpu::read_report(report, objects, stream);
  if (!read) return tl::unexpected(read.error());
  const auto file = gpu::download_file(*read, objects, stream);
  if (!file) return tl::unexpected(file.error());
  if (const auto summary = validate(file->bytes()); !summary)
    return gpu::fail(build::ErrorCode::kBackend, "not a valid scene: ", to_string(summary.error()));
  return build::measure_tree(*open_buffer(file->bytes())).sah_cost;
}

Result<MeasuredInstances> measure(const BufferView& view, std::uint32_t count, const gpu::InstanceOptions& options,
                                  const InstanceBench& bench, hipStream_t stream) {
  auto prepared = Prepared::make(view, count, options, stream);
  if (!prepared) return tl::unexpected(std::move(prepared.error()));
  Prepared& on = *prepared;
  const gpu::InstanceReport* report = nullptr;
  const auto work = [&]() -> Result<void> {
    auto enqueued = gpu::enqueue_instances(on.objects, {on.instances.data(), count}, options, on.scene.buffer.data(),
                                           on.scratch.data(), stream);
    if (!enqueued) return tl::unexpected(std::move(enqueued.error()));
    report = *enqueued;
    return {};
  };
  const auto median = median_of(bench.repeats, stream, work);
  if (!median) return tl::unexpected(median.error());
  MeasuredInstances result{on.sizes, *median};
  const auto sah_cost = judge(report, on.objects, stream);
  if (!sah_cost) return tl::unexpected(sah_cost.error());
  result.sah_cost = *sah_cost;
  if (!bench.graphs) return result;
  const auto graph = median_of_graph(bench.repeats, stream, work);
  if (!graph) return tl::unexpected(graph.error());
  result.graph_ms = *graph;
  return result;
}

}  // namespace

bool run_instances(const InstanceBench& bench, hipStream_t stream, nlohmann::json& results) {
  if (bench.counts.empty()) return true;
  const auto scene = ball();
  if (!scene) {
    std::cerr << "bench_gpu_build: " << scene.error().message << "\n";
    return false;
  }
  const auto view = open_buffer(scene->buffer.bytes());
  MarkdownTable table({"instances", "builder", "boxes of", "ms", "ms in a graph", "SAH cost", "B output", "B scratch"});
  bool good = true;
  for (const std::string& text : bench.counts)
    for (const std::string& builder : bench.builders)
      for (const InstanceBounds bounds : {InstanceBounds::kRoot, InstanceBounds::kChildren}) {
        const char* word = bounds == InstanceBounds::kRoot ? "root" : "children";
        const auto tree = parse_builder(builder);
        const std::uint32_t count = parse_count(text);
        const auto measured = !tree        ? tl::unexpected(tree.error())
                              : count == 0 ? gpu::fail(build::ErrorCode::kInvalidInput, "not a number of instances")
                                           : measure(*view, count, {.tree = *tree, .bounds = bounds}, bench, stream);
        if (!measured) {
          std::cerr << "bench_gpu_build: " << text << " instances, " << builder << ": " << measured.error().message
                    << "\n";
          good = false;
          continue;
        }
        table.add({text, builder, word, format_number(measured->median_ms, 3),
                   bench.graphs ? format_number(measured->graph_ms, 3) : "-", format_number(measured->sah_cost, 3),
                   std::to_string(measured->sizes.output), std::to_string(measured->sizes.scratch)});
        results.push_back({{"instances", count},
                           {"builder", builder},
                           {"bounds", word},
                           {"median_ms", measured->median_ms},
                           {"graph_ms", measured->graph_ms},
                           {"sah_cost", measured->sah_cost},
                           {"output_bytes", measured->sizes.output},
                           {"scratch_bytes", measured->sizes.scratch}});
      }
  std::cout << table.text();
  return good;
}

}  // namespace hiprt::bench
