/// make_bench_scene DIR TRIANGLES: generates scenes for bench_variants in every layout.
/// Files:
/// procedural.LAYOUT.bvh, and procedural_boxes.LAYOUT.bvh with boxes as custom primitives among the triangles.

#include "../common/procedural.h"
#include "../common/random.h"

#include <hiprt_build/build.h>
#include <hiprt_build/file.h>

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
    const auto bvh = build::build(input, {.nodes = layout.layout, .tool = "make_bench_scene"});
    if (!bvh) return tl::unexpected(bvh.error());
    const auto path = folder / (name + "." + layout.name + ".bvh");
    if (auto written = build::write_file(path, bvh->buffer.bytes()); !written) return written;
  }
  return {};
}

build::Result<void> write_scenes(const std::filesystem::path& folder, std::uint32_t triangles) {
  const tools::Mesh mesh = procedural_mesh(triangles);
  const build::TriangleMesh input{.positions = mesh.positions, .triangles = mesh.triangles, .name = "procedural"};
  if (auto done = write_trees(folder, "procedural", {.meshes = {&input, 1}}); !done) return done;
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
  std::filesystem::create_directories(argv[1], ignored);
  const auto written = hiprt::bench::write_scenes(argv[1], triangles);
  if (!written) std::cerr << "make_bench_scene: " << written.error().message << "\n";
  return written ? 0 : 1;
}
