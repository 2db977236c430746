// Each call of the GPU runtime that fails, in every function that makes calls: one error, no memory lost, and the next
// call of the function gives the same bytes as before.

#include <hiprt_build/gpu/batch.h>
#include <hiprt_build/gpu/import.h>
#include <hiprt_build/gpu/refit.h>
#include <tests/gpu/every_call.h>
#include <tests/oracle/motions.h>
#include <tests/oracle/odd_meshes.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

void check_builder(const gpu::BuildOptions& options) {
  Input input({oracle::star(2, kSeed), oracle::torus(12, 10, 0.3)}, {std::vector<Box>(20, Box{{0, 0, 0}, {1, 1, 1}})});
  if (options.presplit_budget > 1) input.geometries.pop_back();
  check_every_call(build::name(options.builder), [&](Allocation& allocator) -> gpu::Result<Bytes> {
    const auto scene = gpu::build_scene(input.geometries, options, nullptr, allocator);
    if (!scene) return tl::unexpected(scene.error());
    return as_bytes(gpu::download_file(*scene, "test_faults", nullptr));
  });
}

}  // namespace

TEST_CASE("memory, copies and scenes of files") {
  const std::vector<std::byte> data(1000, std::byte{7});
  check_every_call("arrays", [&](Allocation& allocator) -> gpu::Result<Bytes> {
    auto array = gpu::DeviceArray<std::byte>::from(data, nullptr, allocator);
    if (!array) return tl::unexpected(array.error());
    if (auto filled = array->fill(std::byte{3}, nullptr); !filled) return tl::unexpected(filled.error());
    return array->to_vector(nullptr);
  });
  const build::Bvh bvh = must(build::build(oracle::views({oracle::star(2, kSeed)})));
  check_every_call("upload_scene", [&](Allocation& allocator) -> gpu::Result<Bytes> {
    const auto scene = gpu::upload_scene(std::as_const(bvh).buffer.bytes(), nullptr, allocator);
    if (!scene) return tl::unexpected(scene.error());
    Bytes bytes(bvh.buffer.size());
    if (auto done = scene->buffer.download(bytes, nullptr); !done) return tl::unexpected(done.error());
    if (auto done = gpu::check(hipStreamSynchronize(nullptr), "hipStreamSynchronize"); !done)
      return tl::unexpected(done.error());
    return bytes;
  });
}

TEST_CASE("choices of the fastest of several launches") {
  check_every_call("Tuner", [&](Allocation& allocator) -> gpu::Result<Bytes> {
    auto array = gpu::DeviceArray<std::byte>::make(100, nullptr, allocator);
    if (!array) return tl::unexpected(array.error());
    gpu::Tuner tuner;
    const auto fastest =
        tuner.choose("fills", 3, nullptr, [&](unsigned) { return array->fill(std::byte{3}, nullptr); });
    if (!fastest) return tl::unexpected(fastest.error());
    return array->to_vector(nullptr);
  });
}

TEST_CASE("builds of scenes") { check_builder({.builder = build::Builder::kHploc}); }

TEST_CASE("other builders") {
  check_builder({.builder = build::Builder::kLbvh});
  check_builder({.builder = build::Builder::kPloc});
  check_builder({.builder = build::Builder::kSah});
  check_builder({.builder = build::Builder::kSbvh, .presplit_budget = 1.3, .reinsertion_rounds = 2});
}

TEST_CASE("refits of scenes") {
  Input input({oracle::star(2, kSeed)}), moved({oracle::twisted(oracle::star(2, kSeed), 0.5)});
  CountingAllocator outside;
  gpu::BuiltScene scene = must(gpu::build_scene(input.geometries, {}, nullptr, outside));
  const gpu::SceneParts parts = gpu::parts_of(scene);
  check_every_call("refit", [&](Allocation& allocator) -> gpu::Result<Bytes> {
    auto scratch = gpu::DeviceBuffer::make(gpu::refit_scratch(parts), nullptr, allocator);
    if (!scratch) return tl::unexpected(scratch.error());
    const auto report = gpu::enqueue_refit(parts, moved.geometries, scratch->data(), nullptr);
    if (!report) return tl::unexpected(report.error());
    return as_bytes(gpu::download_file(scene, "test_faults", nullptr));
  });
}

TEST_CASE("batches of small scenes") {
  Input input({oracle::star(1, kSeed)});
  const auto triangles = input.geometries[0].primitive_count;
  const std::vector<std::uint32_t> first{0, triangles / 3, triangles};
  CountingAllocator outside;
  const auto device_first = must(gpu::DeviceArray<std::uint32_t>::from(first, nullptr, outside));
  const gpu::DeviceGeometry& mesh = input.geometries[0];
  const gpu::DeviceBatch batch{mesh.positions, mesh.triangles, mesh.position_count, first, device_first.data()};
  check_every_call("batch", [&](Allocation& allocator) -> gpu::Result<Bytes> {
    const auto memory = Memory::make(gpu::batch_sizes(batch), allocator);
    if (!memory) return tl::unexpected(memory.error());
    const auto scenes = gpu::enqueue_batch(batch, {}, const_cast<std::byte*>(memory->output.data()),
                                           const_cast<std::byte*>(memory->scratch.data()), nullptr);
    if (!scenes) return tl::unexpected(scenes.error());
    const auto compact = gpu::compact_batch(*scenes, nullptr, allocator);
    if (!compact) return tl::unexpected(compact.error());
    const auto file = gpu::download_file(compact->scenes, 1, nullptr, allocator);
    if (!file) return tl::unexpected(file.error());
    return bytes_of(*file);
  });
}

TEST_CASE("imported trees") {
  Input input({oracle::soup(2, 0.5, kSeed)});
  CountingAllocator outside;
  const std::vector<gpu::ImportedNode> nodes{{{}, {}, {0, 1}, {1, 1}}};
  std::vector<gpu::ImportedLeaf> leaves(2);
  leaves[1].primitive = 1;
  const auto device_nodes = must(gpu::DeviceArray<gpu::ImportedNode>::from(nodes, nullptr, outside));
  const auto device_leaves = must(gpu::DeviceArray<gpu::ImportedLeaf>::from(leaves, nullptr, outside));
  const gpu::DeviceTree tree{device_nodes.data(), device_leaves.data(), 2};
  check_every_call("import", [&](Allocation& allocator) -> gpu::Result<Bytes> {
    auto memory = Memory::make(gpu::import_sizes(input.geometries[0], tree), allocator);
    if (!memory) return tl::unexpected(memory.error());
    const auto report =
        gpu::enqueue_import(input.geometries[0], tree, {}, memory->output.data(), memory->scratch.data(), nullptr);
    if (!report) return tl::unexpected(report.error());
    const auto scene = gpu::compact(*report, nullptr, allocator);
    if (!scene) return tl::unexpected(scene.error());
    return as_bytes(gpu::download_file(*scene, "test_faults", nullptr));
  });
}

namespace {

constexpr std::uint32_t kInstances = 20;

/// @param by_update a second call changes the tree that the first one has made.
void check_instances(const std::string& name, bool by_update) {
  const build::Bvh object = must(build::build(oracle::views({oracle::star(1, kSeed)})));
  const std::vector<std::span<const std::byte>> files{object.buffer.bytes()};
  const std::vector<build::Instance> one(1);
  const build::Bvh file = must(build::build_instances(files, one));
  const BufferView view = *open_buffer(file.buffer.bytes());
  std::vector<gpu::DeviceInstance> instances(kInstances);
  CountingAllocator outside;
  const auto place = [&](float distance) {
    for (std::uint32_t i = 0; i < kInstances; ++i) instances[i].to_scene.row[0][3] = distance * static_cast<float>(i);
    return must(gpu::DeviceArray<gpu::DeviceInstance>::from(instances, nullptr, outside));
  };
  const auto first = place(3), moved = place(4);
  check_every_call(name, [&](Allocation& allocator) -> gpu::Result<Bytes> {
    const auto sizes = gpu::instance_sizes(gpu::objects_in(view), kInstances);
    if (!sizes) return tl::unexpected(sizes.error());
    auto scene = gpu::upload_scene(view, nullptr, allocator, sizes->output);
    if (!scene) return tl::unexpected(scene.error());
    auto scratch = gpu::DeviceBuffer::make(sizes->scratch, nullptr, allocator);
    if (!scratch) return tl::unexpected(scratch.error());
    const gpu::SceneObjects objects = gpu::objects_of(*scene, view);
    auto report =
        gpu::enqueue_instances(objects, {first.data(), kInstances}, {}, scene->buffer.data(), scratch->data(), nullptr);
    if (report && by_update)
      report =
          gpu::enqueue_update(objects, {moved.data(), kInstances}, {}, scene->buffer.data(), scratch->data(), nullptr);
    if (!report) return tl::unexpected(report.error());
    const auto read = gpu::read_report(*report, objects, nullptr);
    if (!read) return tl::unexpected(read.error());
    return as_bytes(gpu::download_file(*read, objects, nullptr));
  });
}

}  // namespace

TEST_CASE("trees over instances") { check_instances("instances", false); }

TEST_CASE("updates of trees over instances") { check_instances("update of instances", true); }
