#include "build_speed.h"

#include <benchmarks/common/device_memory.h>
#include <benchmarks/common/gpu_medians.h>
#include <benchmarks/common/markdown.h>
#include <benchmarks/gpu_build/bench_data.h>
#include <hiprt_build/gpu/batch.h>
#include <hiprt_build/gpu/objects.h>

#include <nlohmann/json.hpp>

namespace hiprt::bench {
namespace {

using build::Result;

/// Rows of a table and of JSON.
class Comparison {
 public:
  Comparison(const std::string& head, unsigned repeats, hipStream_t stream, nlohmann::json& results)
      : repeats_(repeats), stream_(stream), results_(&results), name_(head), table_({head, "own ms", "ms", "x own"}) {}

  Result<void> add(const std::string& function, const Enqueue& own, const Enqueue& named) {
    const Enqueue contestants[] = {own, named};
    const auto medians = medians_of(contestants, repeats_, stream_);
    if (!medians) return tl::unexpected(medians.error());
    const double ratio = (*medians)[1] / (*medians)[0];
    table_.add({function, format_number((*medians)[0], 3), format_number((*medians)[1], 3), format_number(ratio, 2)});
    results_->push_back({{"scene", name_},
                         {"function", function},
                         {"own_ms", (*medians)[0]},
                         {"median_ms", (*medians)[1]},
                         {"of_own", ratio}});
    return {};
  }
  std::string text() const { return table_.text(); }

 private:
  unsigned repeats_;
  hipStream_t stream_;
  nlohmann::json* results_;
  std::string name_;
  MarkdownTable table_;
};

Result<void> dropped(const auto& enqueued) {
  if (!enqueued) return tl::unexpected(enqueued.error());
  return {};
}

/// Output and scratch memory.
struct Memory {
  gpu::DeviceBuffer output, scratch;

  static Result<Memory> make(const Result<gpu::BuildSizes>& sizes) {
    if (!sizes) return tl::unexpected(sizes.error());
    auto output = gpu::DeviceBuffer::make(sizes->output, nullptr, device_memory());
    if (!output) return tl::unexpected(output.error());
    auto scratch = gpu::DeviceBuffer::make(sizes->scratch, nullptr, device_memory());
    if (!scratch) return tl::unexpected(scratch.error());
    return Memory{std::move(*output), std::move(*scratch)};
  }
};

Result<void> compare_builder(Comparison& comparison, Library& library, DeviceMesh& mesh, const char* name,
                             build::Builder builder, hiprtBuildFlags flags, hipStream_t stream) {
  const gpu::DeviceGeometry geometry = mesh.own();
  const gpu::BuildOptions how{.builder = builder};
  auto memory = Memory::make(gpu::build_sizes({&geometry, 1}, how));
  if (!memory) return tl::unexpected(memory.error());
  const hiprtGeometryBuildInput input = mesh.named();
  const hiprtBuildOptions options{flags, 0};
  const auto built = library.build(input, options, stream);
  if (!built) return tl::unexpected(built.error());
  return comparison.add(
      name,
      [&] {
        return dropped(gpu::enqueue_build({&geometry, 1}, how, memory->output.data(), memory->scratch.data(), stream));
      },
      [&] { return library.rebuild(hiprtBuildOperationBuild, input, options, stream, *built); });
}

Result<void> compare_update(Comparison& comparison, Library& library, DeviceMesh& mesh, hipStream_t stream) {
  const gpu::DeviceGeometry geometry = mesh.own();
  auto scene = gpu::build_scene({&geometry, 1}, {}, stream, device_memory());
  if (!scene) return tl::unexpected(scene.error());
  const gpu::SceneParts parts = gpu::parts_of(*scene);
  auto scratch = gpu::DeviceBuffer::make(gpu::refit_scratch(parts), nullptr, device_memory());
  if (!scratch) return tl::unexpected(scratch.error());
  const hiprtGeometryBuildInput input = mesh.named();
  const hiprtBuildOptions options{hiprtBuildFlagBitPreferBalancedBuild, 0};
  const auto built = library.build(input, options, stream);
  if (!built) return tl::unexpected(built.error());
  return comparison.add(
      "update of a balanced build",
      [&] {
        return dropped(gpu::enqueue_refit(parts, {&geometry, 1}, scratch->data(), stream));
      },
      [&] { return library.rebuild(hiprtBuildOperationUpdate, input, options, stream, *built); });
}

Result<void> compare_scene(Comparison& comparison, Library& library, DeviceMesh& mesh, std::uint32_t count,
                           hipStream_t stream) {
  const hiprtBuildOptions options{hiprtBuildFlagBitPreferFastBuild, 0};
  const auto geometry = library.build(mesh.named(), options, stream);
  if (!geometry) return tl::unexpected(geometry.error());
  std::vector<gpu::DeviceInstance> own = make_instances(count);
  std::vector<hiprtFrameMatrix> frames(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    own[i].object = i;
    for (unsigned row = 0; row < 3; ++row)
      for (unsigned column = 0; column < 4; ++column) frames[i].matrix[row][column] = own[i].to_scene.row[row][column];
  }
  hiprtInstance instance;
  instance.type = hiprtInstanceTypeGeometry;
  instance.geometry = *geometry;
  const std::vector<hiprtInstance> named(count, instance);
  Result<void> done;
  const auto upload = [&]<class T>(const std::vector<T>& values) {
    auto array = gpu::DeviceArray<T>::from(values, stream, device_memory());
    if (array && done) done = gpu::check(hipStreamSynchronize(stream), "hipStreamSynchronize");
    if (!array) done = tl::unexpected(array.error());
    return array ? std::move(*array) : gpu::DeviceArray<T>();
  };
  const gpu::DeviceGeometry description = mesh.own();
  auto object = gpu::build_scene({&description, 1}, {.builder = build::Builder::kLbvh}, stream, device_memory());
  if (!object) return tl::unexpected(object.error());
  // HIPRT's instances name their objects by address. So this library's side gets an object per instance, too.
  const auto views = upload(std::vector<SceneView>(count, object->view));
  auto records = upload(std::vector<ObjectRecord>(count));
  const auto own_instances = upload(own);
  auto named_instances = upload(named);
  auto named_frames = upload(frames);
  if (!done) return done;
  const gpu::SceneObjects objects = gpu::separate_objects(records.data(), count);
  const gpu::InstanceOptions how{.tree = {.builder = build::Builder::kLbvh}};
  auto memory = Memory::make(gpu::instance_sizes(objects, count, how));
  if (!memory) return tl::unexpected(memory.error());
  hiprtSceneBuildInput input{};
  input.instances = named_instances.data();
  input.instanceCount = count;
  input.instanceFrames = named_frames.data();
  input.frameCount = count;
  input.frameType = hiprtFrameTypeMatrix;
  const auto scene = library.build(input, options, stream);
  if (!scene) return tl::unexpected(scene.error());
  return comparison.add(
      "fast scene of " + std::to_string(count) + " instances",
      [&]() -> Result<void> {
        if (auto made = gpu::enqueue_objects(views.data(), count, records.data(), stream); !made) return made;
        return dropped(gpu::enqueue_instances(objects, {own_instances.data(), count, {}}, how, memory->output.data(),
                                              memory->scratch.data(), stream));
      },
      [&] { return library.rebuild(input, options, stream, *scene); });
}

}  // namespace

Result<std::string> time_builds(Library& library, const std::string& name, DeviceMesh& mesh, std::uint32_t instances,
                                unsigned repeats, hipStream_t stream, nlohmann::json& results) {
  Comparison comparison(name + ": builds", repeats, stream, results);
  auto done = compare_builder(comparison, library, mesh, "fast (LBVH)", build::Builder::kLbvh,
                              hiprtBuildFlagBitPreferFastBuild, stream);
  if (done)
    done = compare_builder(comparison, library, mesh, "balanced (H-PLOC)", build::Builder::kHploc,
                           hiprtBuildFlagBitPreferBalancedBuild, stream);
  if (done)
    done = compare_builder(comparison, library, mesh, "high (hq)", build::Builder::kHq,
                           hiprtBuildFlagBitPreferHighQualityBuild, stream);
  if (done) done = compare_update(comparison, library, mesh, stream);
  if (done) done = compare_scene(comparison, library, mesh, instances, stream);
  if (!done) return tl::unexpected(done.error());
  return comparison.text();
}

Result<std::string> time_batch(Library& library, std::uint32_t count, unsigned repeats, hipStream_t stream,
                               nlohmann::json& results) {
  Comparison comparison("batch", repeats, stream, results);
  const Ball ball = make_ball(8, 9);
  auto mesh = DeviceMesh::make(ball.positions, ball.triangles, device_memory());
  if (!mesh) return tl::unexpected(mesh.error());
  const std::vector<gpu::DeviceGeometry> geometries(count, mesh->own());
  auto described = gpu::DeviceArray<gpu::DeviceGeometry>::from(geometries, nullptr, device_memory());
  if (!described) return tl::unexpected(described.error());
  if (auto done = gpu::check(hipDeviceSynchronize(), "hipDeviceSynchronize"); !done)
    return tl::unexpected(done.error());
  const gpu::GeometryBatch batch{geometries, described->data()};
  auto memory = Memory::make(gpu::batch_sizes(batch));
  if (!memory) return tl::unexpected(memory.error());
  const std::vector<hiprtGeometryBuildInput> inputs(count, mesh->named());
  const hiprtBuildOptions options{hiprtBuildFlagBitPreferFastBuild, hiprtMaxBatchBuildMaxPrimCount};
  auto built = library.build(inputs, options, stream);
  if (!built) return tl::unexpected(built.error());
  const auto done = comparison.add(
      std::to_string(count) + " x " + std::to_string(ball.triangles.size()) + " triangles",
      // HIPRT's descriptions are on the host. So this library's are copied from there, too.
      [&]() -> Result<void> {
        if (auto copied = described->upload(geometries, stream); !copied) return copied;
        return dropped(gpu::enqueue_batch(batch, {}, memory->output.data(), memory->scratch.data(), stream));
      },
      [&] { return library.rebuild(inputs, options, stream, *built); });
  if (!done) return tl::unexpected(done.error());
  return comparison.text();
}

}  // namespace hiprt::bench
