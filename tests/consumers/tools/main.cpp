#include <hiprt_build/open_scene.h>
#include <hiprt_device/hiprt_device.h>

#include <cstdio>

int main() {
  const auto file = hiprt::open_scene(CORNER_BVH);
  if (!file) return std::fprintf(stderr, "%s\n", file.error().message.c_str()), 1;
  const hiprt::Ray ray{.origin = {0.25f, 0.25f, 1}, .direction = {0, 0, -1}};
  const hiprt::Hit hit = hiprt::closest_hit(file->scene(), ray);
  std::printf("t = %g, primitive %u\n", static_cast<double>(hit.t), hit.primitive);
  return hit.found() && hit.t == 1 && hit.primitive == 0 ? 0 : 1;
}
