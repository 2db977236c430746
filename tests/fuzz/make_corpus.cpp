/// Writes seed files into the folder given as argument: bvh/ for fuzz_bvh, and a folder for each reader of
/// fuzz_readers.

#include "../format/shape_files.h"
#include "../format/test_scene.h"
#include "make_reader_corpus.h"

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

using namespace hiprt;
using namespace hiprt::test;

namespace {

/// Two levels: groups of a triangle's instances. One in each group moves.
TestFile moving_file(NodeLayout layout, MotionKind kind) {
  const std::vector<build::Position> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<build::Triangle> triangles{{0, 1, 2}};
  const build::TriangleMesh meshes[] = {{positions, triangles}};
  const auto mesh = build::build(meshes, {.nodes = layout});
  if (!mesh) throw std::runtime_error(mesh.error().message);
  const build::Motion motion{.keys = {{.time = 0},
                                      {.time = 0.5f, .translation = {1, 2, 3}, .rotation = {0, 0, 1, 1}},
                                      {.time = 1, .scale = {2, 1, 1}, .shear = {0.5f, 0, 0}}},
                             .kind = kind};
  const std::span<const std::byte> files[] = {mesh->buffer.bytes()};
  const std::vector<build::Instance> twig{{.object = 0}, {.object = 0, .motion = &motion}},
      tree{{.object = 1, .id = 7}, {.object = 1, .mask = 3, .motion = &motion}};
  const std::vector<std::span<const build::Instance>> groups{twig, tree};
  const auto scene = build::build_instances(build::InstancedScene{files, groups});
  if (!scene) throw std::runtime_error(scene.error().message);
  return TestFile(scene->buffer.bytes());
}

std::vector<TestFile> make_bvh_files() {
  std::vector<TestScene> scenes{far_scene()};
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized})
    for (auto* make : {row_scene, split_scene, root_leaf_scene, empty_scene, custom_scene, custom_root_scene})
      scenes.push_back(make(layout));
  std::vector<TestFile> files;
  for (const TestScene& scene : scenes) files.push_back(scene.write());
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized})
    for (auto* make : {shape_file, shape_scene_file}) files.push_back(make(layout));
  for (const MotionKind kind : {MotionKind::kSlerp, MotionKind::kNlerp, MotionKind::kMatrix})
    files.push_back(moving_file(NodeLayout::kPlanes, kind));
  files.push_back(moving_file(NodeLayout::kQuantized, MotionKind::kSlerp));
  return files;
}

void make_corpus(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "bvh");
  int number = 0;
  for (const TestFile& seed : make_bvh_files()) {
    std::ofstream file(folder / "bvh" / ("seed-" + std::to_string(number++) + ".bvh"), std::ios::binary);
    file.write(reinterpret_cast<const char*>(seed.data()), static_cast<std::streamsize>(seed.size()));
    if (!file.flush()) throw std::runtime_error("cannot write into " + folder.string());
  }
  fuzz::make_reader_corpus(folder);
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: make_corpus FOLDER\n");
    return 2;
  }
  try {
    make_corpus(arguments[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_corpus: %s\n", error.what());
    return 1;
  }
  return 0;
}
