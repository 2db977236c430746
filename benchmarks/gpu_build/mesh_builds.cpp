#include "mesh_builds.h"

#include "builder_choice.h"

#include <benchmarks/common/gpu_medians.h>
#include <hiprt_build/file.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/gpu/build_steps.h>
#include <hiprt_build/gpu/device.h>
#include <hiprt_build/gpu/refit.h>
#include <hiprt_build/statistics.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

namespace hiprt::bench {
namespace {

using build::Result;

Result<NodeLayout> find_layout(const std::string& name) {
  constexpr const char* kNames[] = {"float", "planes", "half", "quantized"};
  for (std::uint32_t i = 0; i < std::size(kNames); ++i)
    if (name == kNames[i]) return static_cast<NodeLayout>(i + 1);
  return gpu::fail(build::ErrorCode::kInvalidInput, "no layout '", name,
                   "'; expected float, planes, half or quantized");
}

Result<void> time_builds(const DeviceMesh& mesh, const gpu::BuildOptions& options, unsigned repeats, std::byte* output,
                         std::byte* scratch, hipStream_t stream, std::vector<double>& milliseconds) {
  const gpu::DeviceGeometry geometry = mesh.geometry();
  auto watch = gpu::StreamTimer::make();
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

double median(std::vector<double>& values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

/// One build in steps. @return milliseconds of the device. @param most receives the bytes that it held at once.
Result<double> build_in_steps(const gpu::DeviceGeometry& geometry, const gpu::BuildOptions& options, hipStream_t stream,
                              std::uint64_t& most) {
  auto steps = gpu::BuildSteps::make({&geometry, 1}, options);
  if (!steps) return tl::unexpected(std::move(steps.error()));
  auto watch = gpu::StreamTimer::make();
  if (!watch) return tl::unexpected(watch.error());
  gpu::DeviceBuffer scene;
  double sum = 0;
  while (!steps->done()) {
    auto output = gpu::DeviceBuffer::make(steps->sizes().output, stream, device_memory());
    if (!output) return tl::unexpected(output.error());
    auto scratch = gpu::DeviceBuffer::make(steps->sizes().scratch, stream, device_memory());
    if (!scratch) return tl::unexpected(scratch.error());
    most = std::max<std::uint64_t>(most, scene.size() + output->size() + scratch->size());
    auto done = watch->start(stream);
    if (done) done = steps->enqueue(output->data(), scratch->data(), stream);
    if (done) done = watch->stop(stream);
    if (done) done = steps->wait();
    if (!done) return tl::unexpected(done.error());
    const auto took = watch->milliseconds();
    if (!took) return tl::unexpected(took.error());
    sum += double{*took};
    scene = std::move(*output);
  }
  return sum;
}

/// The longest time between two progress callbacks of build_scene(), in milliseconds. A cancelled build ends within it.
Result<double> longest_callback_gap(const gpu::DeviceGeometry& geometry, gpu::BuildOptions options,
                                    hipStream_t stream) {
  using Clock = std::chrono::steady_clock;
  Clock::time_point last = Clock::now();
  Clock::duration longest{0};
  const auto note = [&] {
    const Clock::time_point now = Clock::now();
    longest = std::max(longest, now - last);
    last = now;
  };
  options.progress = [&](const build::Progress&) {
    note();
    return true;
  };
  const auto scene = gpu::build_scene({&geometry, 1}, options, stream, device_memory());
  if (!scene) return tl::unexpected(scene.error());
  note();
  return std::chrono::duration<double, std::milli>(longest).count();
}

/// Builds in steps, and builds by build_scene().
Result<void> time_steps(const DeviceMesh& mesh, const gpu::BuildOptions& options, unsigned repeats, hipStream_t stream,
                        Measured& measured) {
  const gpu::DeviceGeometry geometry = mesh.geometry();
  std::vector<double> device, host, gaps;
  for (unsigned i = 0; i < repeats + 3; ++i) {
    const auto milliseconds = build_in_steps(geometry, options, stream, measured.steps_bytes);
    if (!milliseconds) return tl::unexpected(milliseconds.error());
    const auto start = std::chrono::steady_clock::now();
    const auto scene = gpu::build_scene({&geometry, 1}, options, stream, device_memory());
    if (!scene) return tl::unexpected(scene.error());
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    const auto longest = longest_callback_gap(geometry, options, stream);
    if (!longest) return tl::unexpected(longest.error());
    if (i < 3) continue;
    device.push_back(*milliseconds);
    host.push_back(took.count());
    gaps.push_back(*longest);
  }
  measured.steps_ms = median(device);
  measured.scene_ms = median(host);
  measured.callback_gap_ms = median(gaps);
  return {};
}

/// Refits to the same vertices; moved vertices take the same time.
Result<double> time_refits(const DeviceMesh& mesh, gpu::BuiltScene& built, unsigned repeats, hipStream_t stream) {
  const gpu::SceneParts parts = gpu::parts_of(built);
  auto scratch = gpu::DeviceBuffer::make(gpu::refit_scratch(parts), stream, device_memory());
  if (!scratch) return tl::unexpected(scratch.error());
  const gpu::DeviceGeometry geometry = mesh.geometry();
  return median_of(repeats, stream, [&] { return gpu::enqueue_refit(parts, {&geometry, 1}, scratch->data(), stream); });
}

/// Downloads, validates and measures the BVH, and then times refits.
Result<void> judge(const DeviceMesh& mesh, const gpu::BuildReport* report, const MeshBench& bench, hipStream_t stream,
                   Measured& measured) {
  auto built = gpu::compact(report, stream, device_memory());
  if (!built) return tl::unexpected(built.error());
  measured.report = built->report;
  const auto file = gpu::download_file(*built, "bench_gpu_build", stream);
  if (!file) return tl::unexpected(file.error());
  measured.file_bytes = file->size();
  const auto summary = validate(file->bytes());
  if (!summary) return gpu::fail(build::ErrorCode::kBackend, "not a valid BVH: ", to_string(summary.error()));
  measured.sah_cost = build::measure_tree(*open_buffer(file->bytes())).sah_cost;
  if (!bench.save.empty())
    if (auto saved =
            build::write_file(bench.save + "/" + mesh.name + "." + file_name(measured.builder) + ".bvh", file->bytes());
        !saved)
      return saved;
  const auto refitted = time_refits(mesh, *built, bench.repeats, stream);
  if (!refitted) return tl::unexpected(refitted.error());
  measured.refit_ms = *refitted;
  return {};
}

}  // namespace

Result<DeviceMesh> DeviceMesh::make(std::string name, std::span<const build::Position> positions,
                                    std::span<const build::Triangle> triangles) {
  DeviceMesh mesh;
  mesh.name = std::move(name);
  auto all_positions = gpu::DeviceArray<build::Position>::from(positions, nullptr, device_memory());
  if (!all_positions) return tl::unexpected(all_positions.error());
  auto all_triangles = gpu::DeviceArray<build::Triangle>::from(triangles, nullptr, device_memory());
  if (!all_triangles) return tl::unexpected(all_triangles.error());
  mesh.positions_ = std::move(*all_positions);
  mesh.triangles_ = std::move(*all_triangles);
  if (auto done = gpu::check(hipDeviceSynchronize(), "hipDeviceSynchronize"); !done)
    return tl::unexpected(done.error());
  return mesh;
}

gpu::DeviceGeometry DeviceMesh::geometry() const {
  return {.positions = positions_.data(),
          .triangles = triangles_.data(),
          .position_count = static_cast<std::uint32_t>(positions_.size()),
          .primitive_count = static_cast<std::uint32_t>(triangles_.size())};
}

Result<Measured> measure(const DeviceMesh& mesh, const std::string& builder_name, const MeshBench& bench,
                         hipStream_t stream) {
  auto parsed = parse_builder(builder_name);
  if (!parsed) return tl::unexpected(parsed.error());
  gpu::BuildOptions& build_options = *parsed;
  const auto nodes = find_layout(bench.nodes);
  if (!nodes) return tl::unexpected(nodes.error());
  build_options.nodes = *nodes;
  build_options.pair_triangles = bench.pairs;
  const gpu::DeviceGeometry geometry = mesh.geometry();
  const auto sizes = gpu::build_sizes({&geometry, 1}, build_options);
  if (!sizes) return tl::unexpected(sizes.error());
  auto output = gpu::DeviceBuffer::make(sizes->output, stream, device_memory());
  if (!output) return tl::unexpected(output.error());
  auto scratch = gpu::DeviceBuffer::make(sizes->scratch, stream, device_memory());
  if (!scratch) return tl::unexpected(scratch.error());
  std::vector<double> times;
  if (auto timed = time_builds(mesh, build_options, bench.repeats, output->data(), scratch->data(), stream, times);
      !timed)
    return tl::unexpected(timed.error());
  Measured result{.scene = mesh.name,
                  .builder = builder_name,
                  .triangles = geometry.primitive_count,
                  .output_bytes = sizes->output,
                  .scratch_bytes = sizes->scratch,
                  .min_ms = times.front(),
                  .median_ms = times[times.size() / 2],
                  .max_ms = times.back()};
  // The build must overwrite every byte of the BVH.
  auto done = output->fill(std::byte{0xa5}, stream);
  if (done) done = scratch->fill(std::byte{0xa5}, stream);
  if (!done) return tl::unexpected(done.error());
  const auto report = gpu::enqueue_build({&geometry, 1}, build_options, output->data(), scratch->data(), stream);
  if (!report) return tl::unexpected(report.error());
  if (auto judged = judge(mesh, *report, bench, stream, result); !judged) return tl::unexpected(judged.error());
  output->release();
  scratch->release();
  if (auto timed = time_steps(mesh, build_options, bench.repeats, stream, result); !timed)
    return tl::unexpected(timed.error());
  return result;
}

}  // namespace hiprt::bench
