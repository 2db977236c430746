/// Writes seed files for fuzz_bvh into the folder given as argument.

#include "../format/shape_files.h"
#include "../format/test_scene.h"

#include <cstdio>
#include <fstream>

using namespace hiprt;
using namespace hiprt::test;

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: make_corpus FOLDER\n");
    return 2;
  }
  bool good = true;
  int number = 0;
  std::vector<TestScene> scenes{far_scene()};
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized})
    for (auto* make : {row_scene, split_scene, root_leaf_scene, empty_scene, custom_scene, custom_root_scene})
      scenes.push_back(make(layout));
  std::vector<TestFile> seeds;
  for (const TestScene& scene : scenes) seeds.push_back(scene.write());
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized})
    for (auto* make : {shape_file, shape_scene_file}) seeds.push_back(make(layout));
  for (const TestFile& seed : seeds) {
    std::ofstream file(std::string(arguments[1]) + "/seed-" + std::to_string(number++) + ".bvh", std::ios::binary);
    file.write(reinterpret_cast<const char*>(seed.data()), static_cast<std::streamsize>(seed.size()));
    good = good && file.flush();
  }
  if (!good) std::fprintf(stderr, "make_corpus: cannot write into '%s'\n", arguments[1]);
  return good ? 0 : 1;
}
