#include "objects.h"

#include "bench_data.h"

#include <benchmarks/common/device_memory.h>
#include <benchmarks/common/gpu_medians.h>
#include <benchmarks/common/markdown.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/gpu/objects.h>

#include <nlohmann/json.hpp>

#include <iostream>

namespace hiprt::bench {
namespace {

using build::Result;

/// Device memory for everything. Values are set by make(), in this order.
struct World {
  std::vector<gpu::DeviceArray<build::Position>> positions;
  std::vector<gpu::DeviceArray<build::Triangle>> triangles;
  std::vector<gpu::DeviceGeometry> geometries;
  gpu::DeviceArray<gpu::DeviceGeometry> device_geometries;
  gpu::DeviceArray<gpu::DeviceInstance> frames[2];
  gpu::DeviceArray<ObjectRecord> records;
  gpu::DeviceBuffer batch_output, batch_scratch, output, scratch;

  static Result<World> make(std::uint32_t count, hipStream_t stream) {
    World world;
    Keeper keeper;
    // Six shapes, from 4 to 220 triangles: a block builds each.
    for (const unsigned rings : {1u, 2u, 3u, 5u, 8u, 10u}) {
      const Ball ball = make_ball(rings, rings + 1);
      keeper.keep(world.positions.emplace_back(),
                  gpu::DeviceArray<build::Position>::from(ball.positions, stream, device_memory()));
      keeper.keep(world.triangles.emplace_back(),
                  gpu::DeviceArray<build::Triangle>::from(ball.triangles, stream, device_memory()));
      // The arrays are read before the copies are waited for.
      keeper.keep(gpu::check(hipStreamSynchronize(stream), "hipStreamSynchronize"));
      if (!keeper.done()) return tl::unexpected(keeper.done().error());
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto& points = world.positions[i % world.positions.size()];
      const auto& corners = world.triangles[i % world.triangles.size()];
      world.geometries.push_back({.positions = points.data(),
                                  .triangles = corners.data(),
                                  .position_count = static_cast<std::uint32_t>(points.size()),
                                  .primitive_count = static_cast<std::uint32_t>(corners.size())});
    }
    std::vector<gpu::DeviceInstance> instances[2] = {make_instances(count, 1), make_instances(count, 1)};
    for (std::uint32_t i = 0; i < count; ++i) {
      instances[0][i].object = instances[1][i].object = i;
      // The second frame: a tenth of an object's size further.
      for (unsigned axis = 0; axis < 3; ++axis) instances[1][i].to_scene.row[axis][3] += 0.1f;
    }
    keeper.keep(world.device_geometries,
                gpu::DeviceArray<gpu::DeviceGeometry>::from(world.geometries, stream, device_memory()));
    for (unsigned f = 0; f < 2; ++f)
      keeper.keep(world.frames[f], gpu::DeviceArray<gpu::DeviceInstance>::from(instances[f], stream, device_memory()));
    keeper.keep(world.records, gpu::DeviceArray<ObjectRecord>::make(count, stream, device_memory()));
    const auto batch = gpu::batch_sizes(world.batch());
    const auto top = gpu::instance_sizes(gpu::separate_objects(nullptr, count), count);
    if (!batch || !top) return tl::unexpected(batch ? top.error() : batch.error());
    keeper.keep(world.batch_output, gpu::DeviceBuffer::make(batch->output, stream, device_memory()));
    keeper.keep(world.batch_scratch, gpu::DeviceBuffer::make(batch->scratch, stream, device_memory()));
    keeper.keep(world.output, gpu::DeviceBuffer::make(top->output, stream, device_memory()));
    keeper.keep(world.scratch, gpu::DeviceBuffer::make(top->scratch, stream, device_memory()));
    keeper.keep(gpu::check(hipStreamSynchronize(stream), "hipStreamSynchronize"));
    if (!keeper.done()) return tl::unexpected(keeper.done().error());
    return world;
  }

  gpu::GeometryBatch batch() const { return {geometries, device_geometries.data()}; }
};

/// Validating more objects takes minutes.
constexpr std::uint32_t kMostValidated = 100000;

struct MeasuredObjects {
  double batch_ms = 0, records_ms = 0, build_ms = 0, update_ms = 0, frame_ms = 0;
};

Result<MeasuredObjects> measure(std::uint32_t count, unsigned repeats, hipStream_t stream) {
  auto made = World::make(count, stream);
  if (!made) return tl::unexpected(std::move(made.error()));
  World& world = *made;
  const gpu::SceneObjects objects = gpu::separate_objects(world.records.data(), count);
  gpu::BatchScenes scenes;
  const gpu::InstanceReport* report = nullptr;
  const auto keep = [](auto& to, auto enqueued) -> Result<void> {
    if (!enqueued) return tl::unexpected(std::move(enqueued.error()));
    to = *enqueued;
    return {};
  };
  const auto batch = [&] {
    return keep(scenes,
                gpu::enqueue_batch(world.batch(), {}, world.batch_output.data(), world.batch_scratch.data(), stream));
  };
  const auto records = [&] { return gpu::enqueue_objects(scenes.views, count, world.records.data(), stream); };
  const auto build = [&] {
    return keep(report, gpu::enqueue_instances(objects, {world.frames[0].data(), count}, {}, world.output.data(),
                                               world.scratch.data(), stream));
  };
  const auto update = [&] {
    return keep(report, gpu::enqueue_update(objects, {world.frames[1].data(), count}, {}, world.output.data(),
                                            world.scratch.data(), stream));
  };
  const auto frame = [&]() -> Result<void> {
    if (auto done = batch(); !done) return done;
    if (auto done = records(); !done) return done;
    return build();
  };
  MeasuredObjects result;
  Result<void> done;
  const auto time = [&](double& ms, const auto& work) {
    if (!done) return;
    const auto median = median_of(repeats, stream, work);
    if (median)
      ms = *median;
    else
      done = tl::unexpected(median.error());
  };
  time(result.batch_ms, batch);
  time(result.records_ms, records);
  time(result.build_ms, build);
  time(result.frame_ms, frame);
  time(result.update_ms, update);
  if (!done) return tl::unexpected(std::move(done.error()));
  const auto read = gpu::read_report(report, objects, stream);
  if (!read) return tl::unexpected(read.error());
  if (count > kMostValidated) return result;
  const auto file = gpu::download_file(*read, objects, stream);
  if (!file) return tl::unexpected(file.error());
  if (const auto summary = validate(file->bytes()); !summary)
    return gpu::fail(build::ErrorCode::kBackend, "not a valid scene: ", to_string(summary.error()));
  return result;
}

}  // namespace

bool run_objects(const ObjectBench& bench, hipStream_t stream, nlohmann::json& results) {
  if (bench.counts.empty()) return true;
  MarkdownTable table({"objects", "batch ms", "records ms", "build ms", "all three ms", "update ms"});
  bool good = true;
  for (const std::string& text : bench.counts) {
    const std::uint32_t count = parse_count(text);
    const auto measured = count == 0 ? gpu::fail(build::ErrorCode::kInvalidInput, "not a number of objects")
                                     : measure(count, bench.repeats, stream);
    if (!measured) {
      std::cerr << "bench_gpu_build: " << text << " objects: " << measured.error().message << "\n";
      good = false;
      continue;
    }
    table.add({text, format_number(measured->batch_ms, 3), format_number(measured->records_ms, 3),
               format_number(measured->build_ms, 3), format_number(measured->frame_ms, 3),
               format_number(measured->update_ms, 3)});
    results.push_back({{"objects", count},
                       {"batch_ms", measured->batch_ms},
                       {"records_ms", measured->records_ms},
                       {"build_ms", measured->build_ms},
                       {"frame_ms", measured->frame_ms},
                       {"update_ms", measured->update_ms}});
  }
  std::cout << table.text();
  return good;
}

}  // namespace hiprt::bench
