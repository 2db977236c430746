#include <tools/build/gpu_builder.h>

#include <tools/base/gpu_device.h>

#include <hiprt_build/format/file_layout.h>
#include <hiprt_build/format/instance_bounds.h>
#include <hiprt_build/gpu/build_steps.h>
#include <hiprt_build/gpu/event.h>
#include <hiprt_build/gpu/instances.h>

#include <algorithm>
#include <chrono>

namespace hiprt::tools {
namespace {

/// Copies of the meshes' arrays.
struct DeviceMeshes {
  std::vector<gpu::DeviceArray<build::Position>> positions;
  std::vector<gpu::DeviceArray<build::Triangle>> triangles;
  std::vector<gpu::DeviceGeometry> geometries;

  build::Result<void> add(const build::TriangleMesh& mesh, gpu::Allocator& allocator) {
    auto points = gpu::DeviceArray<build::Position>::from(mesh.positions.contiguous(), nullptr, allocator);
    if (!points) return tl::unexpected(points.error());
    auto corners = gpu::DeviceArray<build::Triangle>::from(mesh.triangles.contiguous(), nullptr, allocator);
    if (!corners) return tl::unexpected(corners.error());
    geometries.push_back({.positions = points->data(),
                          .triangles = corners->data(),
                          .position_count = static_cast<std::uint32_t>(mesh.positions.size()),
                          .primitive_count = static_cast<std::uint32_t>(mesh.triangles.size()),
                          .mask = mesh.mask});
    positions.push_back(std::move(*points));
    triangles.push_back(std::move(*corners));
    return {};
  }
};

constexpr std::uint64_t kMaxPositions = std::uint64_t{1} << 31;

/// Refused before anything is copied.
build::Result<void> check_counts(std::span<const build::TriangleMesh> meshes) {
  for (std::size_t m = 0; m < meshes.size(); ++m)
    if (meshes[m].triangles.size() > gpu::kMaxBuildPrimitives || meshes[m].positions.size() >= kMaxPositions)
      return gpu::fail(build::ErrorCode::kTooLarge, "mesh ", m, " has ", meshes[m].triangles.size(), " triangles and ",
                       meshes[m].positions.size(), " vertices, a GPU build takes ", gpu::kMaxBuildPrimitives, " and ",
                       kMaxPositions - 1);
  return {};
}

build::BuildStatistics statistics(const gpu::BuildReport& report, std::span<const build::TriangleMesh> meshes) {
  build::BuildStatistics result;
  result.builder = report.builder;
  for (const build::TriangleMesh& mesh : meshes) result.triangles += mesh.triangles.size();
  result.dropped_not_finite = report.dropped_not_finite;
  result.dropped_degenerate = report.dropped_degenerate;
  result.pairs = report.pairs;
  result.nodes = report.nodes;
  result.leaves = report.leaves;
  return result;
}

/// What a build took: the device from the first kernel of each step to its last, and the most memory at once.
struct Effort {
  double seconds = 0;
  std::uint64_t bytes = 0;
};

/// As gpu::build_scene(), measured.
build::Result<gpu::BuiltScene> measured_build(std::span<const gpu::DeviceGeometry> geometries,
                                              const gpu::BuildOptions& options, gpu::Allocator& allocator,
                                              Effort& effort) {
  auto steps = gpu::BuildSteps::make(geometries, options);
  if (!steps) return tl::unexpected(std::move(steps.error()));
  auto watch = gpu::StreamTimer::make();
  if (!watch) return tl::unexpected(std::move(watch.error()));
  gpu::DeviceBuffer scene;
  while (!steps->done()) {
    const gpu::BuildSizes sizes = steps->sizes();
    auto output = gpu::DeviceBuffer::make(sizes.output, nullptr, allocator);
    if (!output) return tl::unexpected(std::move(output.error()));
    auto scratch = gpu::DeviceBuffer::make(sizes.scratch, nullptr, allocator);
    if (!scratch) return tl::unexpected(std::move(scratch.error()));
    effort.bytes = std::max(effort.bytes, scene.size() + output->size() + scratch->size());
    auto done = watch->start(nullptr);
    if (done) done = steps->enqueue(output->data(), scratch->data(), nullptr);
    if (done) done = watch->stop(nullptr);
    if (done) done = steps->wait();
    if (!done) return tl::unexpected(std::move(done.error()));
    const auto milliseconds = watch->milliseconds();
    if (!milliseconds) return tl::unexpected(milliseconds.error());
    effort.seconds += static_cast<double>(*milliseconds) * 1e-3;
    scene = std::move(*output);
  }
  const gpu::BuildReport& report = steps->report();
  if (report.status == gpu::BuildStatus::kBadIndex)
    return gpu::fail(build::ErrorCode::kInvalidInput, report.bad_indices,
                     " triangles have an index beyond their mesh's positions");
  return gpu::BuiltScene{std::move(scene), report.view, report};
}

}  // namespace

build::Result<build::Bvh> build_on_gpu(std::span<const build::TriangleMesh> meshes,
                                       const build::BuildOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  if (const auto device = usable_device(); !device) return tl::unexpected(device.error());
  if (auto checked = check_counts(meshes); !checked) return tl::unexpected(std::move(checked.error()));
  gpu::DeviceAllocator allocator;
  DeviceMeshes copies;
  for (const build::TriangleMesh& mesh : meshes)
    if (auto added = copies.add(mesh, allocator); !added) return tl::unexpected(std::move(added.error()));
  const gpu::BuildOptions wanted{.builder = options.builder,
                                 .nodes = options.nodes,
                                 .split_budget = options.split_budget,
                                 .presplit_budget = options.presplit_budget,
                                 .reinsertion_rounds = options.reinsertion_rounds,
                                 .ploc_radius = options.ploc_radius,
                                 .max_leaf_triangles = options.max_leaf_triangles,
                                 .pair_triangles = options.pair_triangles,
                                 .widen_boxes = options.widen_boxes,
                                 .costs = options.costs,
                                 .progress = options.progress};
  Effort effort;
  const auto scene = measured_build(copies.geometries, wanted, allocator, effort);
  if (!scene) return tl::unexpected(scene.error());
  auto file = gpu::download_file(*scene, options.tool, nullptr);
  if (!file) return tl::unexpected(std::move(file.error()));
  build::Bvh bvh{std::move(*file), statistics(scene->report, meshes)};
  bvh.statistics.tree_seconds = effort.seconds;
  bvh.statistics.scratch_bytes_peak = effort.bytes;
  bvh.statistics.total_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return bvh;
}

namespace {

/// The objects' files on the device, one behind the other, with room before them.
struct DeviceObjects {
  gpu::DeviceBuffer memory;
  gpu::DeviceArray<ObjectRecord> records;
  gpu::SceneObjects objects;
  gpu::BuildSizes sizes;

  static build::Result<DeviceObjects> make(std::span<const std::span<const std::byte>> files, std::uint32_t instances,
                                           const gpu::InstanceOptions& options, gpu::Allocator& allocator) {
    std::vector<ObjectRecord> records;
    std::uint64_t end = 0;
    for (const std::span<const std::byte> file : files) {
      const auto view = open_buffer(file);
      if (!view) return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput, to_string(view.error())});
      records.push_back(format_detail::describe(*view));
      records.back().offset = align_up(end, kBufferAlignment);
      end = records.back().offset + file.size();
    }
    gpu::SceneObjects objects{nullptr, nullptr, static_cast<std::uint32_t>(files.size()),
                              files.empty() ? NodeLayout::kPlanes : open_buffer(files[0])->layout()};
    const auto sizes = gpu::instance_sizes(objects, instances, options);
    if (!sizes) return tl::unexpected(sizes.error());
    auto memory = gpu::DeviceBuffer::make(sizes->output + end, nullptr, allocator, kBufferAlignment);
    if (!memory) return tl::unexpected(memory.error());
    for (std::size_t i = 0; i < files.size(); ++i)
      if (auto copied = memory->upload(files[i], nullptr, sizes->output + records[i].offset); !copied)
        return tl::unexpected(copied.error());
    auto on_device = gpu::DeviceArray<ObjectRecord>::from(records, nullptr, allocator);
    if (!on_device) return tl::unexpected(on_device.error());
    objects.base = memory->data() + sizes->output;
    objects.records = on_device->data();
    // The records are read before they go.
    if (auto passed = gpu::check(hipStreamSynchronize(nullptr), "hipStreamSynchronize"); !passed)
      return tl::unexpected(passed.error());
    return DeviceObjects{std::move(*memory), std::move(*on_device), objects, *sizes};
  }
};

}  // namespace

build::Result<build::Bvh> join_on_gpu(std::span<const std::span<const std::byte>> objects,
                                      std::span<const build::Instance> instances,
                                      const build::InstanceOptions& options) {
  if (const auto device = usable_device(); !device) return tl::unexpected(device.error());
  gpu::DeviceAllocator allocator;
  std::vector<gpu::DeviceInstance> copies;
  copies.reserve(instances.size());
  for (const build::Instance& instance : instances)
    copies.push_back({instance.to_scene, instance.object, instance.mask, instance.id,
                      instance.without_filter ? InstanceFlags::kNoFilter : 0});
  const auto count = static_cast<std::uint32_t>(instances.size());
  const gpu::InstanceOptions wanted{
      .tree = {.builder = options.tree.builder, .reinsertion_rounds = options.tree.reinsertion_rounds},
      .bounds = options.bounds};
  auto there = DeviceObjects::make(objects, count, wanted, allocator);
  if (!there) return tl::unexpected(std::move(there.error()));
  const auto from = gpu::DeviceArray<gpu::DeviceInstance>::from(copies, nullptr, allocator);
  if (!from) return tl::unexpected(from.error());
  auto scratch = gpu::DeviceBuffer::make(there->sizes.scratch, nullptr, allocator);
  if (!scratch) return tl::unexpected(std::move(scratch.error()));
  const auto report = gpu::enqueue_instances(there->objects, {from->data(), count}, wanted, there->memory.data(),
                                             scratch->data(), nullptr);
  if (!report) return tl::unexpected(report.error());
  const auto read = gpu::read_report(*report, there->objects, nullptr);
  if (!read) return tl::unexpected(read.error());
  auto file = gpu::download_file(*read, there->objects, nullptr, options.tree.tool);
  if (!file) return tl::unexpected(std::move(file.error()));
  build::Bvh bvh{std::move(*file), {}};
  bvh.statistics.customs = count;
  bvh.statistics.nodes = read->nodes;
  bvh.statistics.leaves = read->leaves;
  return bvh;
}

}  // namespace hiprt::tools
