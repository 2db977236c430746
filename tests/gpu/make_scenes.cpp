// make_scenes FOLDER SEED: writes the scenes of that seed in every layout, as FOLDER/soup.float.bvh and so on. It is a
// program of its own, so that the GPU's test program runs without the builder's libraries.

#include <hiprt_build/build.h>
#include <hiprt_build/file.h>
#include <hiprt_device/format/widened_boxes.h>
#include <tests/gpu/random_scene.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

build::Result<void> write(const SceneSource& source, NodeLayout layout, const std::filesystem::path& folder) {
  std::vector<Box> balls, segments;
  for (const Sphere& sphere : source.spheres) balls.push_back(SphereSet::bounds(sphere));
  for (const std::uint32_t first : segments_of(source.hair))
    segments.push_back(RoundCurveSet::bounds(source.hair[first], source.hair[first + 1]));
  const std::vector<build::CustomGeometry> customs{{.boxes = balls, .type = 0}, {.boxes = segments, .type = 1}};
  const auto meshes = oracle::views(source.meshes);
  const build::SceneInput input{meshes, std::span(customs).first(source.has_customs() ? 2 : 0)};
  const auto bvh = build::build(
      input,
      {.builder = source.builder, .nodes = layout, .max_leaf_triangles = 4, .widen_boxes = may_be_widened(layout)});
  if (!bvh) return tl::unexpected(bvh.error());
  std::printf("%s: %llu triangles, %llu spheres and segments of hair\n", file_name(source.name, layout).c_str(),
              static_cast<unsigned long long>(bvh->statistics.triangles),
              static_cast<unsigned long long>(bvh->statistics.customs));
  return build::write_file(folder / file_name(source.name, layout), bvh->buffer.bytes());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: make_scenes FOLDER SEED\n");
    return 2;
  }
  std::filesystem::create_directories(argv[1]);
  for (const SceneSource& source : scene_sources(std::stoull(argv[2])))
    for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized})
      if (const auto written = write(source, layout, argv[1]); !written) {
        std::fprintf(stderr, "make_scenes: %s\n", written.error().message.c_str());
        return 1;
      }
  return 0;
}
