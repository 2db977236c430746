/// The C++ side of python_overhead.py: traces a batch of rays by closest_hits() whenever a line comes in.

#include <hiprt_build/exec/threads.h>
#include <hiprt_build/open_scene.h>
#include <hiprt_build/trace_rays.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

namespace {

/// Rows of six floats: origin and direction.
std::vector<hiprt::Ray> read_rays(const char* path) {
  std::vector<hiprt::Ray> rays;
  std::ifstream file(path, std::ios::binary);
  for (float row[6]; file.read(reinterpret_cast<char*>(row), sizeof row);)
    rays.push_back({.origin = {row[0], row[1], row[2]}, .direction = {row[3], row[4], row[5]}});
  return rays;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: bench_python_overhead SCENE.bvh RAYS THREADS\nStarted by python_overhead.py.\n");
    return 2;
  }
  const auto file = hiprt::open_scene(argv[1]);
  if (!file) {
    std::fprintf(stderr, "%s\n", file.error().message.c_str());
    return 1;
  }
  const hiprt::SceneView scene = file->scene();
  const std::vector<hiprt::Ray> rays = read_rays(argv[2]);
  const auto threads = static_cast<unsigned>(std::strtoul(argv[3], nullptr, 10));
  std::vector<hiprt::Hit> hits(rays.size());
  const hiprt::ParallelLoop loop = [&](std::size_t count, const std::function<void(std::size_t)>& body) {
    hiprt::build::Threads::run(threads, [&] { hiprt::build::Threads::for_each(count, body); });
  };
  for (std::string line; std::getline(std::cin, line);) {
    const auto start = std::chrono::steady_clock::now();
    if (!hiprt::closest_hits(scene, rays, hits, loop)) return 1;
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    std::size_t found = 0;
    for (const hiprt::Hit& hit : hits) found += hit.found() ? 1 : 0;
    std::printf("%.9f %zu\n", seconds.count(), found);
    std::fflush(stdout);
  }
  return 0;
}
