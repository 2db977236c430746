/// make_bench_scene DIR TRIANGLES: generates scenes for bench_variants in every layout.
/// Files:
/// procedural.LAYOUT.bvh, and procedural_boxes.LAYOUT.bvh with boxes as custom primitives among the triangles;
/// instances/turned.planes.bvh, instances of two objects.
/// Boxes are widened where the layout can have that.

#include "../common/procedural.h"
#include "../common/random.h"

#include <hiprt_build/build.h>
#include <hiprt_build/file.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/motion.h>
#include <hiprt_device/format/widened_boxes.h>

#include <charconv>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <string_view>

namespace hiprt::bench {
namespace {

struct NamedLayout {
  const char* name;
  NodeLayout layout;
};
constexpr NamedLayout kLayouts[] = {{"float", NodeLayout::kFloat},
                                    {"planes", NodeLayout::kPlanes},
                                    {"half", NodeLayout::kHalf},
                                    {"quantized", NodeLayout::kQuantized}};

/// Cubes above the ground.
std::vector<Box> make_boxes(std::uint32_t count) {
  Random random;
  const auto between = [&](double low, double high) { return static_cast<float>(random.between(low, high)); };
  std::vector<Box> boxes;
  for (std::uint32_t i = 0; i < count; ++i) {
    const float center[3] = {between(-kGroundHalf, kGroundHalf), between(0.0, 10.0),
                             between(-kGroundHalf, kGroundHalf)};
    const float half = between(0.1, 1.0);
    Box box{};
    for (int axis = 0; axis < 3; ++axis) {
      box.min[axis] = center[axis] - half;
      box.max[axis] = center[axis] + half;
    }
    boxes.push_back(box);
  }
  return boxes;
}

build::Result<void> write_boxes(const std::filesystem::path& path, const std::vector<Box>& boxes) {
  const auto count = static_cast<std::uint32_t>(boxes.size());
  std::vector<std::byte> bytes(sizeof(count) + boxes.size() * sizeof(Box));
  std::memcpy(bytes.data(), &count, sizeof(count));
  std::memcpy(bytes.data() + sizeof(count), boxes.data(), boxes.size() * sizeof(Box));
  return build::write_file(path, bytes);
}

build::Result<void> write_trees(const std::filesystem::path& folder, const std::string& name,
                                const build::SceneInput& input) {
  for (const NamedLayout& layout : kLayouts) {
    const auto bvh = build::build(
        input, {.nodes = layout.layout, .widen_boxes = may_be_widened(layout.layout), .tool = "make_bench_scene"});
    if (!bvh) return tl::unexpected(bvh.error());
    const auto path = folder / (name + "." + layout.name + ".bvh");
    if (auto written = build::write_file(path, bvh->buffer.bytes()); !written) return written;
  }
  return {};
}

/// Turned, stretched and mirrored instances side by side.
std::vector<build::Instance> make_instances() {
  constexpr auto half = static_cast<float>(kGroundHalf);
  std::vector<build::Instance> instances;
  for (std::uint32_t i = 0; i < 6; ++i) {
    const std::uint32_t column = i % 3, row = i / 3;
    const auto x = static_cast<float>(column), z = static_cast<float>(row);
    const build::MotionKey key{.translation = {2 * half * (x - 1), z, 2 * half * (z - 0.5f)},
                               .rotation = {0.1f * x, 0.3f + 0.2f * x, 0.05f * z, 1},
                               .scale = {i == 4 ? -0.7f : 0.7f, 0.5f + 0.2f * x, 0.8f}};
    instances.push_back({.object = i % 2, .to_scene = build::compose(key).to_scene, .id = 100 + i});
  }
  return instances;
}

build::Result<void> write_instances(const std::filesystem::path& path, std::uint32_t triangles) {
  std::vector<build::Buffer> files;
  for (const std::uint32_t count : {triangles, triangles / 2 + 2}) {
    const tools::Mesh mesh = procedural_mesh(count);
    const build::TriangleMesh input{.positions = mesh.positions, .triangles = mesh.triangles};
    auto bvh = build::build({&input, 1});
    if (!bvh) return tl::unexpected(bvh.error());
    files.push_back(std::move(bvh->buffer));
  }
  const std::span<const std::byte> objects[] = {files[0].bytes(), files[1].bytes()};
  const std::vector<build::Instance> instances = make_instances();
  const std::span<const build::Instance> groups[] = {instances};
  const auto scene = build::build_instances(build::InstancedScene{objects, groups});
  if (!scene) return tl::unexpected(scene.error());
  return build::write_file(path, scene->buffer.bytes());
}

build::Result<void> write_scenes(const std::filesystem::path& folder, std::uint32_t triangles) {
  const tools::Mesh mesh = procedural_mesh(triangles);
  const build::TriangleMesh input{.positions = mesh.positions, .triangles = mesh.triangles, .name = "procedural"};
  if (auto done = write_trees(folder, "procedural", {.meshes = {&input, 1}}); !done) return done;
  if (auto done = write_instances(folder / "instances" / "turned.planes.bvh", triangles); !done) return done;
  const std::vector<Box> boxes = make_boxes(triangles / 16 + 1);
  const build::CustomGeometry customs{.boxes = boxes, .name = "boxes"};
  if (auto done = write_boxes(folder / "procedural_boxes.boxes", boxes); !done) return done;
  return write_trees(folder, "procedural_boxes", {.meshes = {&input, 1}, .customs = {&customs, 1}});
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) {
  const std::string_view text = argc == 3 ? argv[2] : "";
  std::uint32_t triangles = 0;
  if (std::from_chars(text.data(), text.data() + text.size(), triangles).ptr != text.data() + text.size() ||
      triangles < 2) {
    std::cerr << "usage: make_bench_scene DIR TRIANGLES (2 or more)\n";
    return 2;
  }
  std::error_code ignored;
  std::filesystem::create_directories(std::filesystem::path(argv[1]) / "instances", ignored);
  const auto written = hiprt::bench::write_scenes(argv[1], triangles);
  if (!written) std::cerr << "make_bench_scene: " << written.error().message << "\n";
  return written ? 0 : 1;
}
