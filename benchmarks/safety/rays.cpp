/// Traces random rays through a scene on one thread. compare.py compiles it with and without the packages' flags.

#include <hiprt_build/open_scene.h>
#include <hiprt_device/hiprt_device.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <random>
#include <vector>

namespace {

/// Between two points of the scene's bounds.
std::vector<hiprt::Ray> random_rays(const hiprt::Box& bounds, std::size_t count) {
  std::mt19937 random(34);
  std::uniform_real_distribution<float> part(0.0f, 1.0f);
  const auto point = [&] {
    hiprt::Vec3 result(0.0f);
    for (int k = 0; k < 3; ++k) result[k] = bounds.min[k] + part(random) * (bounds.max[k] - bounds.min[k]);
    return result;
  };
  std::vector<hiprt::Ray> rays(count);
  for (hiprt::Ray& ray : rays) {
    ray.origin = point();
    ray.direction = point() - ray.origin;
  }
  return rays;
}

/// Of this thread's processor time: other programs of a busy machine do not count.
double seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Million rays per second in the best of 5 rounds.
template <class Trace> double speed(const std::vector<hiprt::Ray>& rays, const Trace& trace, std::size_t& found) {
  double best = 1e30;
  for (int round = 0; round < 5; ++round) {
    const double start = seconds();
    for (const hiprt::Ray& ray : rays) found += trace(ray).found() ? 1 : 0;
    best = std::min(best, seconds() - start);
  }
  return 1e-6 * static_cast<double>(rays.size()) / best;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: rays SCENE.bvh\nStarted by compare.py.\n");
    return 2;
  }
  const auto file = hiprt::open_scene(argv[1]);
  if (!file) {
    std::fprintf(stderr, "%s\n", file.error().message.c_str());
    return 1;
  }
  const hiprt::SceneView scene = file->scene();
  const auto rays = random_rays(scene.bounds, 300'000);
  std::size_t found = 0;
  const double closest = speed(
      rays, [&](const hiprt::Ray& ray) { return closest_hit(scene, ray); }, found);
  const double any = speed(
      rays, [&](const hiprt::Ray& ray) { return any_hit(scene, ray); }, found);
  std::printf("%.4f %.4f %zu\n", closest, any, found);
  return 0;
}
