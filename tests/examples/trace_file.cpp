// Opens a BVH file and traces one ray through it. Writes the file first where none is named.

#include <hiprt_build/build.h>
#include <hiprt_build/file.h>
#include <hiprt_build/open_scene.h>
#include <hiprt_device/hiprt_device.h>

#include <cstdio>

int main(int argc, char** argv) {
  const char* const path = argc > 1 ? argv[1] : "trace_file.bvh";
  if (argc < 2) {
    const hiprt::build::Position positions[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const hiprt::build::Triangle triangles[] = {{0, 1, 2}};
    const hiprt::build::TriangleMesh meshes[] = {{positions, triangles}};
    const auto bvh = hiprt::build::build(meshes);
    if (!bvh || !hiprt::build::write_file(path, bvh->buffer.bytes())) return 1;
  }
  const auto file = hiprt::open_scene(path);
  if (!file) return std::puts(file.error().message.c_str());
  const hiprt::SceneView scene = file->scene();
  const hiprt::Hit hit = hiprt::closest_hit(scene, {.origin = {0.2f, 0.3f, 2}, .direction = {0, 0, -1}});
  std::printf("t = %g, geometry %u, primitive %u\n", static_cast<double>(hit.t), hit.geometry, hit.primitive);
}
