#include "trace_speed.h"

#include <benchmarks/common/device_memory.h>
#include <benchmarks/common/gpu_medians.h>
#include <benchmarks/common/markdown.h>
#include <benchmarks/common/spawned_rays.h>
#include <hiprt_build/gpu/gpu.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace hiprt::bench {
namespace {

using build::Result;

Result<void> launch(const void* kernel, std::uint32_t count, void** arguments, hipStream_t stream) {
  return gpu::check(
      hipLaunchKernel(kernel, dim3((count + kNamesBlock - 1) / kNamesBlock), dim3(kNamesBlock), arguments, 0, stream),
      "hipLaunchKernel");
}

hiprtRay named(const Ray& ray) {
  hiprtRay result;
  result.origin = {ray.origin.x, ray.origin.y, ray.origin.z};
  result.direction = {ray.direction.x, ray.direction.y, ray.direction.z};
  result.minT = ray.tmin;
  result.maxT = std::min(ray.tmax, std::numeric_limits<float>::max());
  return result;
}

NamedRays named(std::string kind, bool any_hit, const std::vector<Ray>& rays) {
  NamedRays result{std::move(kind), any_hit, {}};
  result.rays.reserve(rays.size());
  for (const Ray& ray : rays) result.rays.push_back(named(ray));
  return result;
}

/// A handle is the address of a view on the device.
Result<void> read_view(SceneView& view, const void* handle) {
  return gpu::check(hipMemcpy(&view, handle, sizeof(view), hipMemcpyDeviceToHost), "hipMemcpy");
}

/// Closest hits with normals.
Result<std::vector<Hit>> trace_hits(hiprtGeometry geometry, const std::vector<hiprtRay>& rays, hipStream_t stream) {
  auto device_rays = gpu::DeviceArray<hiprtRay>::from(rays, stream, device_memory());
  if (!device_rays) return tl::unexpected(device_rays.error());
  auto device_hits = gpu::DeviceArray<Hit>::make(rays.size(), stream, device_memory());
  if (!device_hits) return tl::unexpected(device_hits.error());
  NamesJob job{};
  if (auto read = read_view(job.geometry_view, geometry); !read) return tl::unexpected(read.error());
  job.rays = device_rays->data();
  job.count = static_cast<std::uint32_t>(rays.size());
  Hit* to = device_hits->data();
  void* arguments[] = {&job, &to};
  std::vector<Hit> hits(rays.size());
  auto done = launch(spawn_kernel(), job.count, arguments, stream);
  if (done) done = device_hits->download(hits, stream);
  if (done) done = gpu::check(hipStreamSynchronize(stream), "hipStreamSynchronize");
  if (!done) return tl::unexpected(done.error());
  return hits;
}

/// Rays, results and stacks of one kind of rays on the device.
struct Launches {
  gpu::DeviceArray<hiprtRay> rays;
  gpu::DeviceArray<NamesResult> results;
  gpu::DeviceBuffer stack, instance_stack;
  NamesJob job{};

  static Result<Launches> make(const TracedScene& scene, const std::vector<hiprtRay>& rays, hipStream_t stream) {
    Launches launches;
    Keeper keeper;
    const std::size_t threads = (rays.size() + kNamesBlock - 1) / kNamesBlock * kNamesBlock;
    keeper.keep(launches.rays, gpu::DeviceArray<hiprtRay>::from(rays, stream, device_memory()));
    keeper.keep(launches.results, gpu::DeviceArray<NamesResult>::make(rays.size(), stream, device_memory()));
    keeper.keep(launches.stack,
                gpu::DeviceBuffer::make(threads * kGlobalEntries * sizeof(int), stream, device_memory()));
    keeper.keep(launches.instance_stack,
                gpu::DeviceBuffer::make(threads * hiprtMaxInstanceLevels * sizeof(hiprtInstanceStackEntry), stream,
                                        device_memory()));
    NamesJob& job = launches.job;
    keeper.keep(read_view(job.geometry_view, scene.geometry));
    keeper.keep(read_view(job.scene_view, scene.scene));
    if (!keeper.done()) return tl::unexpected(keeper.done().error());
    job.geometry = scene.geometry;
    job.scene = scene.scene;
    job.stack = {kGlobalEntries, 0, launches.stack.data()};
    job.instance_stack = {hiprtMaxInstanceLevels, 0, launches.instance_stack.data()};
    job.rays = launches.rays.data();
    job.results = launches.results.data();
    job.count = static_cast<std::uint32_t>(rays.size());
    return launches;
  }

  Result<void> enqueue(const NamesKernel& kernel, hipStream_t stream) {
    void* arguments[] = {&job};
    return launch(kernel.kernel, job.count, arguments, stream);
  }

  Result<std::vector<NamesResult>> run(const NamesKernel& kernel, hipStream_t stream) {
    std::vector<NamesResult> found(job.count);
    auto done = enqueue(kernel, stream);
    if (done) done = results.download(found, stream);
    if (done) done = gpu::check(hipStreamSynchronize(stream), "hipStreamSynchronize");
    if (!done) return tl::unexpected(done.error());
    return found;
  }
};

/// @return the number of rays with other hits. Any hits agree if both hit or both miss.
std::size_t count_differences(const std::vector<NamesResult>& a, const std::vector<NamesResult>& b, bool any_hit) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const bool same = any_hit ? (a[i].primitive == kInvalidId) == (b[i].primitive == kInvalidId)
                              : a[i].primitive == b[i].primitive &&
                                    std::bit_cast<std::uint32_t>(a[i].t) == std::bit_cast<std::uint32_t>(b[i].t);
    count += same ? 0 : 1;
  }
  return count;
}

}  // namespace

Result<std::vector<NamedRays>> make_named_rays(hiprtGeometry geometry, const Box& bounds, const tools::Camera& camera,
                                               unsigned width, unsigned height, hipStream_t stream) {
  const tools::CameraRays pixels(camera, width, height);
  std::vector<Ray> primary;
  for (unsigned row = 0; row < height; ++row)
    for (unsigned column = 0; column < width; ++column) primary.push_back(pixels.ray(column + 0.5, row + 0.5));
  std::vector<NamedRays> all{named("primary", false, primary)};
  const auto hits = trace_hits(geometry, all[0].rays, stream);
  if (!hits) return tl::unexpected(hits.error());
  const auto extent = [&](int axis) { return bounds.max[axis] - bounds.min[axis]; };
  const float diagonal = std::hypot(extent(0), extent(1), extent(2));
  all.push_back(named("ao", true, cosine_rays(primary, *hits, 0.1f * diagonal, 1)));
  all.push_back(named("diffuse", false, cosine_rays(primary, *hits, std::numeric_limits<float>::infinity(), 2)));
  std::erase_if(all, [](const NamedRays& rays) { return rays.rays.empty(); });
  return all;
}

Result<std::string> time_traces(const TracedScene& scene, const std::vector<NamedRays>& rays, unsigned repeats,
                                hipStream_t stream, nlohmann::json& results) {
  std::vector<std::string> head{scene.name + ": Mrays/s (x own)"};
  for (const NamedRays& kind : rays) head.push_back(kind.kind);
  MarkdownTable table(head);
  struct Row {
    const NamesKernel* kernel;
    std::vector<std::string> cells;
  };
  std::vector<Row> rows;
  for (const bool in_scene : {false, true})
    for (const auto kernels : {own_kernels(), names_kernels()})
      for (const NamesKernel& kernel : kernels)
        if (kernel.scene == in_scene)
          rows.push_back({&kernel, {std::string(in_scene ? "scene: " : "geometry: ") + kernel.name}});
  for (const NamedRays& kind : rays) {
    auto launches = Launches::make(scene, kind.rays, stream);
    if (!launches) return tl::unexpected(launches.error());
    std::vector<Enqueue> contestants;
    std::vector<Row*> timed;
    for (Row& row : rows)
      if (row.kernel->any_hit == kind.any_hit) {
        contestants.push_back([&, kernel = row.kernel] { return launches->enqueue(*kernel, stream); });
        timed.push_back(&row);
      } else {
        row.cells.emplace_back();
      }
    const auto medians = medians_of(contestants, repeats, stream);
    if (!medians) return tl::unexpected(medians.error());
    std::vector<NamesResult> expected;
    double own_ms = 0;
    for (std::size_t i = 0; i < timed.size(); ++i) {
      const NamesKernel& kernel = *timed[i]->kernel;
      // The first kernel of a kind is this library's own.
      const bool own = i == 0 || timed[i - 1]->kernel->scene != kernel.scene;
      const auto found = launches->run(kernel, stream);
      if (!found) return tl::unexpected(found.error());
      if (own) own_ms = (*medians)[i];
      if (expected.empty()) expected = *found;
      if (const std::size_t others = count_differences(expected, *found, kind.any_hit); others != 0)
        return gpu::fail(build::ErrorCode::kBackend, scene.name, ", ", kind.kind, ": ", others,
                         " rays have other hits with ", timed[i]->cells[0]);
      const double rate = static_cast<double>(kind.rays.size()) / (*medians)[i] / 1e3, ratio = own_ms / (*medians)[i];
      timed[i]->cells.push_back(format_number(rate, 0) + " (" + format_number(ratio, 2) + ")");
      results.push_back({{"scene", scene.name},
                         {"rays", kind.kind},
                         {"count", kind.rays.size()},
                         {"kernel", timed[i]->cells[0]},
                         {"median_ms", (*medians)[i]},
                         {"mrays_s", rate},
                         {"of_own", ratio}});
    }
  }
  for (Row& row : rows) table.add(std::move(row.cells));
  return table.text();
}

Result<std::string> describe_kernels(nlohmann::json& results) {
  MarkdownTable table({"kernel", "registers", "local bytes", "shared bytes per block", "resident threads"});
  for (const auto kernels : {own_kernels(), names_kernels()})
    for (const NamesKernel& kernel : kernels) {
      hipFuncAttributes attributes{};
      if (auto got = gpu::check(hipFuncGetAttributes(&attributes, kernel.kernel), "hipFuncGetAttributes"); !got)
        return tl::unexpected(got.error());
      const auto blocks = gpu::resident_blocks(kernel.kernel, kNamesBlock, 0);
      if (!blocks) return tl::unexpected(blocks.error());
      const std::string name = std::string(kernel.scene ? "scene: " : "geometry: ") + kernel.name;
      table.add({name, std::to_string(attributes.numRegs), std::to_string(attributes.localSizeBytes),
                 std::to_string(attributes.sharedSizeBytes), std::to_string(*blocks * kNamesBlock)});
      results.push_back({{"kernel", name},
                         {"registers", attributes.numRegs},
                         {"local_bytes", attributes.localSizeBytes},
                         {"shared_bytes", attributes.sharedSizeBytes},
                         {"resident_threads", *blocks * kNamesBlock}});
    }
  return table.text();
}

}  // namespace hiprt::bench
