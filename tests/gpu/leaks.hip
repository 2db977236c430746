// leaks [MILLIONS]: rays aimed at the edges and vertices of closed meshes, made on the GPU. From inside not one may
// miss, with the default tests and with Reference; from outside Reference must count an even number of crossings. Fast
// and Plain are counted too, to see that the rays are hard. MILLIONS: rays per mesh, tests and aim (default: a few
// thousand). Exit status 0 if nothing that is guaranteed leaks.

#include <hip/hip_runtime.h>
#include <hiprt_build/build.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/oracle/meshes.h>

#include <cstdio>
#include <cstdlib>
#include <vector>

namespace gpu = hiprt::gpu;
namespace build = hiprt::build;
using hiprt::Ray, hiprt::SceneView, hiprt::Vec3;

namespace {

enum class Aim : unsigned { kEdge, kVertex };

/// A closed mesh around the origin, on the device.
struct MeshView {
  const build::Position* positions;
  const build::Triangle* triangles;
  std::uint32_t count;
  float room;  ///< Radius of a ball around the origin that is inside.
};

/// Numbers of one ray, by its own number (splitmix64).
class Numbers {
 public:
  HIPRT_HD explicit Numbers(std::uint64_t ray) : state_(ray * 0x632be59bd9b4e019u + 20261123u) {}
  HIPRT_HD std::uint32_t next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return static_cast<std::uint32_t>((z ^ z >> 31) >> 32);
  }
  /// In [0, 1).
  HIPRT_HD float unit() { return static_cast<float>(next() >> 8) * 0x1p-24f; }
  /// In [-1, 1).
  HIPRT_HD float both() { return 2.0f * unit() - 1.0f; }

 private:
  std::uint64_t state_;
};

HIPRT_HD Ray aimed_ray(const MeshView& mesh, Aim aim, bool outside, std::uint64_t number) {
  Numbers random(number);
  const build::Triangle triangle = mesh.triangles[random.next() % mesh.count];
  const unsigned first = random.next() % 3;
  const build::Position a = mesh.positions[triangle[first]], b = mesh.positions[triangle[first == 2 ? 0 : first + 1]];
  const float s = aim == Aim::kVertex ? 0.0f : random.unit();
  Ray ray;
  // Each coordinate is below room / 2, or on a face of the cube of edge 16.
  const unsigned face = random.next() % 3;
  for (unsigned k = 0; k < 3; ++k) {
    const float place = random.both();
    const float far = k == face ? (place < 0.0f ? -8.0f : 8.0f) : 8.0f * place;
    ray.origin[static_cast<int>(k)] = outside ? far : 0.5f * mesh.room * place;
    const float target = hiprt::fused_multiply_add(s, b[k] - a[k], a[k]);
    ray.direction[static_cast<int>(k)] = target - ray.origin[static_cast<int>(k)];
  }
  return ray;
}

template <class P>
__global__ void count_misses(SceneView scene, MeshView mesh, Aim aim, std::uint64_t first, unsigned count,
                             unsigned* misses) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count && !hiprt::closest_hit<P>(scene, aimed_ray(mesh, aim, false, first + i)).found()) atomicAdd(misses, 1u);
}

/// @param odd rays with an odd number of crossings.
__global__ void count_odd(SceneView scene, MeshView mesh, Aim aim, std::uint64_t first, unsigned count, unsigned* odd) {
  using P = hiprt::Policies<hiprt::PlanesLayout, hiprt::Reference>;
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  P::Stack::Memory memory;
  hiprt::AllHits<P> query(scene, aimed_ray(mesh, aim, true, first + i), memory);
  unsigned crossings = 0;
  while (query.next_hit().found()) ++crossings;
  if (crossings % 2 != 0) atomicAdd(odd, 1u);
}

using Kernel = void (*)(SceneView, MeshView, Aim, std::uint64_t, unsigned, unsigned*);
struct Check {
  const char* name;
  Kernel kernel;
  bool guaranteed;
};

template <class Triangle, class Boxes> using With = hiprt::Policies<hiprt::PlanesLayout, Triangle, Boxes>;
const Check kChecks[] = {
    {"Watertight, Conservative: leaks", count_misses<With<hiprt::Watertight, hiprt::Conservative>>, true},
    {"Reference, Conservative: leaks", count_misses<With<hiprt::Reference, hiprt::Conservative>>, true},
    {"Reference, Conservative: odd crossings", count_odd, true},
    {"Watertight, Plain: leaks", count_misses<With<hiprt::Watertight, hiprt::Plain>>, false},
    {"Fast, Plain: leaks", count_misses<With<hiprt::Fast, hiprt::Plain>>, false},
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
  float room;
};

/// @return leaks of what is guaranteed.
std::uint64_t check(const NamedMesh& named, std::uint64_t rays) {
  gpu::DeviceAllocator allocator;
  const build::TriangleMesh meshes[] = {named.mesh.view()};
  const build::Bvh bvh = must(build::build(meshes, {.nodes = hiprt::NodeLayout::kPlanes}));
  const auto scene = must(gpu::upload_scene(bvh.buffer.bytes(), nullptr, allocator));
  const auto positions = must(gpu::DeviceArray<build::Position>::from(named.mesh.positions, nullptr, allocator));
  const auto triangles = must(gpu::DeviceArray<build::Triangle>::from(named.mesh.triangles, nullptr, allocator));
  auto counter = must(gpu::DeviceArray<unsigned>::make(1, nullptr, allocator));
  const MeshView view{positions.data(), triangles.data(), static_cast<std::uint32_t>(named.mesh.triangles.size()),
                      named.room};
  std::uint64_t leaks = 0;
  for (const Check& check : kChecks)
    for (const Aim aim : {Aim::kEdge, Aim::kVertex}) {
      constexpr std::uint64_t kMost = 1u << 24;
      std::uint64_t found = 0;
      for (std::uint64_t first = 0; first < rays; first += kMost) {
        const auto count = static_cast<unsigned>(std::min(kMost, rays - first));
        must(counter.fill(std::byte{0}, nullptr));
        must(gpu::launch(check.kernel, std::uint64_t{count}, nullptr, {}, scene.view, view, aim, first, count,
                         counter.data()));
        found += must(counter.to_vector(nullptr))[0];
      }
      std::printf("%s, %s: %s: %llu of %llu rays\n", named.name, aim == Aim::kEdge ? "edges" : "vertices", check.name,
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
