// make_scenes FOLDER SEED: writes the random meshes of that seed as FOLDER/float.bvh and FOLDER/planes.bvh. They are
// made apart from the GPU's program, so that this one runs where the builder's libraries are not.

#include <hiprt_build/build.h>
#include <hiprt_build/file.h>
#include <tests/gpu/random_scene.h>

#include <cstdio>
#include <string>

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: make_scenes FOLDER SEED\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  const auto meshes = hiprt::checks::random_meshes(std::stoull(argv[2]));
  std::filesystem::create_directories(folder);
  for (const auto& [layout, name] :
       {std::pair(hiprt::NodeLayout::kFloat, "float.bvh"), std::pair(hiprt::NodeLayout::kPlanes, "planes.bvh")}) {
    const auto bvh = hiprt::build::build(hiprt::oracle::views(meshes), {.nodes = layout});
    const auto written = bvh ? hiprt::build::write_file(folder / name, bvh->buffer.bytes())
                             : hiprt::build::Result<void>(tl::unexpected(bvh.error()));
    if (!written) {
      std::fprintf(stderr, "make_scenes: %s\n", written.error().message.c_str());
      return 1;
    }
    std::printf("seed %s: %s, %llu triangles\n", argv[2], name,
                static_cast<unsigned long long>(bvh->statistics.triangles));
  }
  return 0;
}
