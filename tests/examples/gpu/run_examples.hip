// Runs the examples' kernels on a GPU: closest hits with each kind of stack, queries that continue after a hit, the ray
// instruction and the library's custom primitives. Compares the hits, bit for bit, with hits that the host finds by
// other code. Prints "N rays, N found, 0 differ" per kernel.

#include <hip/hip_runtime.h>
#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/gpu.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/examples/batch.hip>
#include <tests/examples/blockers.hip>
#include <tests/examples/closest_hit.hip>
#include <tests/examples/global_stack.hip>
#include <tests/examples/layers.hip>
#include <tests/examples/ray_instruction.hip>
#include <tests/examples/restart_stack.hip>
#include <tests/examples/rolling_stack_host.hip>
#include <tests/examples/spheres_and_curves_host.hip>
#include <tests/examples/tiered_stack.hip>
#include <tests/examples/tune.hip>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <tuple>
#include <vector>

namespace gpu = hiprt::gpu;
namespace build = hiprt::build;
using hiprt::Hit, hiprt::Ray, hiprt::SceneView;

namespace {

constexpr unsigned kCount = 2000, kSlots = 512, kBlocks = (kCount + 63) / 64;
constexpr std::uint64_t kSeed = 8513;

/// The value; an error ends the program.
template <class T> T must(tl::expected<T, build::Error> result) {
  if (!result) {
    std::printf("%s\n", result.error().message.c_str());
    std::exit(1);
  }
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

gpu::Allocator& allocator() {
  static gpu::DeviceAllocator made;
  return made;
}

template <class T> gpu::DeviceArray<T> on_device(const std::vector<T>& values) {
  return must(gpu::DeviceArray<T>::from(values, nullptr, allocator()));
}

/// Elements of zero bytes.
template <class T> gpu::DeviceArray<T> cleared(std::size_t count) {
  auto array = must(gpu::DeviceArray<T>::make(count, nullptr, allocator()));
  must(array.fill(std::byte{0}, nullptr));
  return array;
}

/// A scene on the host and on the device.
struct Scene {
  build::Bvh bvh;
  SceneView host;
  gpu::DeviceScene device;

  explicit Scene(build::Result<build::Bvh> built)
      : bvh(must(std::move(built))),
        host(hiprt::make_scene_view(*hiprt::open_buffer(std::as_const(bvh.buffer).bytes()))),
        device(must(gpu::upload_scene(std::as_const(bvh.buffer).bytes(), nullptr, allocator()))) {}
};

/// Without spatial splits: any hits of a triangle in several leaves would count more than once.
Scene soup_scene(hiprt::NodeLayout layout) {
  const hiprt::oracle::Mesh mesh = hiprt::oracle::soup(2000, 0.2, kSeed);
  const std::array<build::TriangleMesh, 1> meshes{mesh.view()};
  return Scene(build::build(meshes, {.builder = build::Builder::kHploc, .nodes = layout}));
}

std::vector<Ray> random_rays() {
  hiprt::oracle::Random random(kSeed);
  std::vector<Ray> rays(kCount);
  for (Ray& ray : rays)
    for (int k = 0; k < 3; ++k) {
      ray.origin[k] = random.uniform_float(-1.2, 1.2);
      ray.direction[k] = random.uniform_float(-1, 1);
    }
  return rays;
}

/// What kernels read and write, and the closest hits of the soup.
struct Work {
  std::vector<Ray> rays = random_rays();
  gpu::DeviceArray<Ray> device_rays = on_device(rays);
  gpu::DeviceArray<Hit> hits = cleared<Hit>(kCount);
  std::vector<Hit> expected = std::vector<Hit>(kCount);

  explicit Work(const SceneView& scene) {
    for (unsigned i = 0; i < kCount; ++i) expected[i] = hiprt::closest_hit(scene, rays[i]);
  }
};

template <class Kernel, class... Arguments> void start(Kernel kernel, unsigned blocks, const Arguments&... arguments) {
  hipLaunchKernelGGL(kernel, dim3(blocks), dim3(64), 0, nullptr, arguments...);
}

/// Prints a line. @return faults: 0 or 1.
int report(const char* name, unsigned found, unsigned differ, unsigned may_differ = 0) {
  std::printf("%s: %u rays, %u found, %u differ\n", name, kCount, found, differ);
  return differ > may_differ || found == 0 ? 1 : 0;
}

bool same(const Hit& a, const Hit& b) { return std::memcmp(&a, &b, sizeof(Hit)) == 0; }

/// The same triangle, and t within rounding.
bool nearly_same(const Hit& a, const Hit& b) {
  if (a.geometry != b.geometry || a.primitive != b.primitive) return false;
  return !a.found() || std::abs(a.t - b.t) <= 1e-4f * (1.0f + std::abs(b.t));
}

/// Takes the hits on the device and clears them. @param may_differ rays.
template <class Same>
int compare(const char* name, gpu::DeviceArray<Hit>& device_hits, const std::vector<Hit>& expected, const Same& is_same,
            unsigned may_differ = 0) {
  const std::vector<Hit> hits = must(device_hits.to_vector(nullptr));
  must(device_hits.fill(std::byte{0}, nullptr));
  unsigned found = 0, differ = 0;
  for (unsigned i = 0; i < kCount; ++i) {
    found += hits[i].found() ? 1 : 0;
    differ += is_same(hits[i], expected[i]) ? 0 : 1;
  }
  return report(name, found, differ, may_differ);
}

int check_stacks(const Scene& soup, Work& work) {
  const SceneView& scene = soup.device.view;
  const Ray* const rays = work.device_rays.data();
  Hit* const hits = work.hits.data();
  int faults = 0;
  start(closest_hits, kBlocks, scene, rays, hits, kCount);
  faults += compare("one call", work.hits, work.expected, same);
  faults += launch_rolling(scene, rays, hits, kCount) == 0 ? 0 : 1;
  faults += compare("rolling", work.hits, work.expected, same);
  start(trace_restarting, kBlocks, scene, rays, hits, kCount);
  faults += compare("restart", work.hits, work.expected, same);
  start(trace_tiered, kBlocks, scene, rays, hits, kCount);
  faults += compare("tiered", work.hits, work.expected, same);

  auto locks = cleared<std::uint32_t>(kSlots);
  hiprt::SpillPool pool{locks.data(), nullptr, kSlots, 0};
  // 64 lanes: no device has wider waves.
  auto memory = cleared<hiprt::StackEntry>(global_stack_bytes(scene, kSlots, 64, pool.entries) / sizeof(*pool.memory));
  pool.memory = memory.data();
  start(trace_global, kBlocks, scene, rays, hits, kCount, pool);
  faults += compare("global", work.hits, work.expected, same);

  auto counters = cleared<unsigned>(2);
  start(trace_persistent, 8u, scene, rays, hits, kCount, counters.data(), counters.data() + 1);
  faults += compare("persistent", work.hits, work.expected, same);
  gpu::Tuner tuner;
  must(trace_fastest(tuner, "random rays", scene, rays, hits, kCount, nullptr));
  return faults + compare("tuned", work.hits, work.expected, same);
}

/// The instruction's triangle test has its own rounding. On GPUs without the instruction both kernels have the host's
/// bits.
int check_instruction(Work& work) {
  const Scene soup = soup_scene(hiprt::NodeLayout::kFloat);
  start(trace_boxes_in_hardware, kBlocks, soup.device.view, work.device_rays.data(), work.hits.data(), kCount);
  const int faults = compare("boxes in hardware", work.hits, work.expected, same);
  start(trace_all_in_hardware, kBlocks, soup.device.view, work.device_rays.data(), work.hits.data(), kCount);
  return faults + compare("all in hardware", work.hits, work.expected, nearly_same, kCount / 100);
}

std::vector<Hit> sorted(std::vector<Hit> hits) {
  const auto key = [](const Hit& hit) { return std::tuple(hit.t, hit.geometry, hit.primitive); };
  std::sort(hits.begin(), hits.end(), [&](const Hit& a, const Hit& b) { return key(a) < key(b); });
  return hits;
}

std::vector<Hit> all_hits(const SceneView& scene, const Ray& ray) {
  hiprt::PrivateStack<>::Memory memory;
  hiprt::AllHits<> query(scene, ray, memory);
  std::vector<Hit> hits;
  for (Hit hit = query.next_hit(); hit.found(); hit = query.next_hit()) hits.push_back(hit);
  return sorted(std::move(hits));
}

int check_layers(const Scene& soup, const Work& work) {
  auto device_layers = cleared<Hit>(kLayers * kCount);
  auto device_found = cleared<unsigned>(kCount);
  start(first_layers, kBlocks, soup.device.view, work.device_rays.data(), device_layers.data(), device_found.data(),
        kCount);
  const std::vector<Hit> layers = must(device_layers.to_vector(nullptr));
  const std::vector<unsigned> found = must(device_found.to_vector(nullptr));
  unsigned full = 0, differ = 0;
  for (unsigned i = 0; i < kCount; ++i) {
    std::vector<Hit> all = all_hits(soup.host, work.rays[i]);
    all.resize(std::min<std::size_t>(kLayers, all.size()));
    full += found[i] == kLayers ? 1 : 0;
    differ += found[i] == all.size() && std::equal(all.begin(), all.end(), &layers[kLayers * i], same) ? 0 : 1;
  }
  return report("layers", full, differ);
}

/// From the soup's closest hits on.
int check_blockers(const Scene& soup, const Work& work) {
  std::vector<Ray> rays = work.rays;
  for (unsigned i = 0; i < kCount; ++i)
    if (work.expected[i].found()) rays[i].origin += work.expected[i].t * rays[i].direction;
  const auto device_rays = on_device(rays);
  const auto starts = on_device(work.expected);
  auto device_blockers = cleared<unsigned>(kCount);
  start(count_blockers, kBlocks, soup.device.view, device_rays.data(), starts.data(), device_blockers.data(), kCount);
  const std::vector<unsigned> blockers = must(device_blockers.to_vector(nullptr));
  unsigned blocked = 0, differ = 0;
  for (unsigned i = 0; i < kCount; ++i) {
    const std::vector<Hit> all = all_hits(soup.host, rays[i]);
    const auto others = std::count_if(all.begin(), all.end(), [&](const Hit& hit) {
      return hit.geometry != work.expected[i].geometry || hit.primitive != work.expected[i].primitive;
    });
    blocked += blockers[i] != 0 ? 1 : 0;
    differ += blockers[i] == std::min<std::size_t>(kMostBlockers, static_cast<std::size_t>(others)) ? 0 : 1;
  }
  return report("blockers", blocked, differ);
}

/// 100 spheres, and 100 segments of 20 curves.
struct Hair {
  std::vector<hiprt::Sphere> spheres;
  std::vector<hiprt::CurveVertex> vertices;
  std::vector<std::uint32_t> first_vertex;

  Hair() {
    hiprt::oracle::Random random(kSeed);
    const auto at = [&] { return random.uniform_float(-1, 1); };
    for (unsigned i = 0; i < 100; ++i) spheres.push_back({{at(), at(), at()}, random.uniform_float(0.02, 0.1)});
    for (std::uint32_t i = 0; i < 120; ++i) {
      vertices.push_back({{at(), at(), at()}, random.uniform_float(0, 0.05)});
      if (i % 6 != 5) first_vertex.push_back(i);
    }
  }

  /// By testing every primitive.
  Hit closest(const Ray& ray) const {
    std::vector<Hit> hits;
    std::uint32_t geometry = 0, primitive = 0;
    const auto add = [&](const hiprt::CustomHit& at) {
      hits.push_back({at.t, at.u, at.v, geometry, primitive, at.normal, at.error});
      return true;
    };
    for (; primitive < spheres.size(); ++primitive)
      hiprt::SphereSet{spheres.data()}.intersect(ray, ray.tmin, ray.tmax, primitive, add);
    geometry = 1;
    for (primitive = 0; primitive < first_vertex.size(); ++primitive)
      hiprt::RoundCurveSet{vertices.data(), first_vertex.data()}.intersect(ray, ray.tmin, ray.tmax, primitive, add);
    return hits.empty() ? Hit{} : sorted(std::move(hits))[0];
  }
};

int check_spheres_and_curves(Work& work) {
  const Hair hair;
  const Scene scene(build_spheres_and_curves(hair.spheres, hair.vertices, hair.first_vertex));
  const auto spheres = on_device(hair.spheres);
  const auto vertices = on_device(hair.vertices);
  const auto first_vertex = on_device(hair.first_vertex);
  launch_spheres_and_curves(scene.device.view, work.device_rays.data(), work.hits.data(), kCount, spheres.data(),
                            vertices.data(), first_vertex.data());
  std::vector<Hit> expected(kCount);
  for (unsigned i = 0; i < kCount; ++i) expected[i] = hair.closest(work.rays[i]);
  return compare("spheres and curves", work.hits, expected, same);
}

}  // namespace

int main() {
  const Scene soup = soup_scene(hiprt::NodeLayout::kPlanes);
  Work work(soup.host);
  int faults = check_stacks(soup, work);
  faults += check_instruction(work);
  faults += check_layers(soup, work);
  faults += check_blockers(soup, work);
  faults += check_spheres_and_curves(work);
  std::printf("%d faults\n", faults);
  return faults;
}
