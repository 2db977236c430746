// leaks [MILLIONS]: rays aimed at edges and vertices of closed meshes, made on the GPU. From inside, no ray may miss
// with the default tests or with Reference. From outside, Reference must count an even number of crossings. Fast and
// Plain are counted too: their misses show that the rays are hard. MILLIONS: rays per mesh, test and aim (default: a
// few thousand). Exit status 0 if no guaranteed test leaks.

#include <hip/hip_runtime.h>
#include <hiprt_build/build.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/probe.h>

#include <cstdio>
#include <cstdlib>
#include <vector>

namespace gpu = hiprt::gpu;
namespace build = hiprt::build;
using hiprt::oracle::Probe, hiprt::oracle::CheckKind;

namespace {

template <class TriangleTest, class BoxTest> struct Tracer {
  struct P : hiprt::Policies {
    using Triangle = TriangleTest;
    using Boxes = BoxTest;
  };
  __device__ hiprt::Hit closest(const hiprt::Ray& ray) const { return hiprt::closest_hit<P>(scene, ray); }
  const hiprt::SceneView& scene;
};

/// Counts crossings.
struct Crossings : Tracer<hiprt::Reference, hiprt::Conservative> {
  __device__ unsigned all(const hiprt::Ray& ray) const {
    typename P::Stack::Memory memory;
    hiprt::AllHits<P> query(scene, ray, memory);
    unsigned count = 0;
    while (query.next_hit().found()) ++count;
    return count;
  }
};

template <class T> __global__ void count_faults(Probe probe, std::uint64_t first, unsigned count, unsigned* faults) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count && hiprt::oracle::check_ray(probe, first + i, T{probe.target.scene}).faults != 0) atomicAdd(faults, 1u);
}

using Kernel = void (*)(Probe, std::uint64_t, unsigned, unsigned*);
struct Check {
  const char* name;
  Kernel kernel;
  bool guaranteed;
  CheckKind edges, vertices;
};

using hiprt::Conservative, hiprt::Plain;
const Check kChecks[] = {
    {"Watertight, Conservative: leaks", count_faults<Tracer<hiprt::Watertight, Conservative>>, true, CheckKind::kEdge,
     CheckKind::kVertex},
    {"Reference, Conservative: leaks", count_faults<Tracer<hiprt::Reference, Conservative>>, true, CheckKind::kEdge,
     CheckKind::kVertex},
    {"Reference, Conservative: odd crossings", count_faults<Crossings>, true, CheckKind::kCrossingsEdge,
     CheckKind::kCrossingsVertex},
    {"Watertight, Plain: leaks", count_faults<Tracer<hiprt::Watertight, Plain>>, false, CheckKind::kEdge,
     CheckKind::kVertex},
    {"Fast, Plain: leaks", count_faults<Tracer<hiprt::Fast, Plain>>, false, CheckKind::kEdge, CheckKind::kVertex},
};

/// The value; an error ends the program.
template <class T> T must(tl::expected<T, build::Error> result) {
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    std::exit(1);
  }
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

struct NamedMesh {
  const char* name;
  hiprt::oracle::Mesh mesh;
  float inner_radius;
};

/// @return leaks of the guaranteed tests.
std::uint64_t check(const NamedMesh& named, std::uint64_t rays) {
  gpu::DeviceAllocator allocator;
  const build::TriangleMesh meshes[] = {named.mesh.view()};
  const build::Bvh bvh = must(build::build(meshes, {.nodes = hiprt::NodeLayout::kPlanes}));
  const auto scene = must(gpu::upload_scene(bvh.buffer.bytes(), nullptr, allocator));
  const auto positions = must(gpu::DeviceArray<build::Position>::from(named.mesh.positions, nullptr, allocator));
  const auto triangles = must(gpu::DeviceArray<build::Triangle>::from(named.mesh.triangles, nullptr, allocator));
  auto counter = must(gpu::DeviceArray<unsigned>::make(1, nullptr, allocator));
  Probe probe;
  probe.target.scene = scene.view;
  probe.target.positions = positions.data();
  probe.target.triangles = triangles.data();
  probe.target.triangle_count = static_cast<std::uint32_t>(named.mesh.triangles.size());
  probe.target.inner_radius = named.inner_radius;
  probe.target.extent = 1.0f;
  std::uint64_t leaks = 0;
  for (const Check& check : kChecks)
    for (const bool edges : {true, false}) {
      probe.kind = edges ? check.edges : check.vertices;
      constexpr std::uint64_t kMost = 1u << 24;
      std::uint64_t found = 0;
      for (std::uint64_t first = 0; first < rays; first += kMost) {
        const auto count = static_cast<unsigned>(std::min(kMost, rays - first));
        must(counter.fill(std::byte{0}, nullptr));
        must(gpu::launch(check.kernel, std::uint64_t{count}, nullptr, {}, probe, first, count, counter.data()));
        found += must(counter.to_vector(nullptr))[0];
      }
      std::printf("%s, %s: %s: %llu of %llu rays\n", named.name, edges ? "edges" : "vertices", check.name,
                  static_cast<unsigned long long>(found), static_cast<unsigned long long>(rays));
      if (check.guaranteed) leaks += found;
    }
  return leaks;
}

}  // namespace

int main(int count, char** words) {
  const double millions = count > 1 ? std::atof(words[1]) : 0.004;
  if (!(millions > 0.0) || count > 2) return std::fprintf(stderr, "usage: leaks [MILLIONS]\n"), 2;
  const auto rays = static_cast<std::uint64_t>(millions * 1e6);
  std::uint64_t leaks = 0;
  for (const NamedMesh& named :
       {NamedMesh{"star", hiprt::oracle::star(4, 11), 0.05f}, NamedMesh{"sphere", hiprt::oracle::icosphere(4), 0.5f},
        NamedMesh{"box", hiprt::oracle::subdivided_box(12, 1.9, 12), 0.9f}})
    leaks += check(named, rays);
  std::printf("%llu guarantees broken\n", static_cast<unsigned long long>(leaks));
  return leaks == 0 ? 0 : 1;
}
