// What is promised under any compiler's settings: no leaks, even crossings, and hits of the same bits. Prints a digest
// of many hits per kind of query, which test_flags.sh compares; exit status 0 if nothing leaks or is crossed oddly.
//
// Everything that goes in lies on a lattice, so that no setting can change it.

#include <hiprt_build/build.h>
#include <hiprt_build/instances.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/oracle/meshes.h>

#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>

using namespace hiprt;
using oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261123;
constexpr float kLattice = 0x1p-12f;

/// A closed mesh around the origin whose vertices are on the lattice, neighbours at different distances.
oracle::Mesh lattice_mesh() {
  oracle::Mesh mesh = oracle::icosphere(3);
  Random random(kSeed);
  for (build::Position& p : mesh.positions) {
    const auto size = static_cast<double>(1024 + random.below(2048));
    for (float& x : p) x = static_cast<float>(std::round(double{x} * size)) * kLattice;
  }
  return mesh;
}

/// A place on the lattice in the cube of half edge @p steps.
Vec3 place(Random& random, std::uint32_t steps) {
  const auto at = [&] {
    return static_cast<float>(static_cast<int>(random.below(2 * steps + 1)) - static_cast<int>(steps)) * kLattice;
  };
  const float x = at(), y = at(), z = at();
  return Vec3(x, y, z);
}

/// From there to a vertex, to the middle of an edge, or anywhere.
Ray aimed(const oracle::Mesh& mesh, const Vec3& from, Random& random) {
  const build::Triangle t = mesh.triangles[random.below(static_cast<std::uint32_t>(mesh.triangles.size()))];
  const build::Position a = mesh.positions[t[0]], b = mesh.positions[t[1]];
  const std::uint32_t kind = random.below(3);
  Vec3 to = place(random, 8192);
  if (kind == 0) to = Vec3(a[0], a[1], a[2]);
  if (kind == 1) to = Vec3(0.5f * (a[0] + b[0]), 0.5f * (a[1] + b[1]), 0.5f * (a[2] + b[2]));
  Ray ray;
  ray.origin = from;
  ray.direction = to - from;
  return ray;
}

/// FNV-1a.
class Digest {
 public:
  void add(std::uint32_t bits) {
    for (int shift = 0; shift < 32; shift += 8) state_ = (state_ ^ (bits >> shift & 255u)) * 0x100000001b3u;
  }
  void add(float x) { add(std::bit_cast<std::uint32_t>(x)); }
  void add(double x) {
    const auto bits = std::bit_cast<std::uint64_t>(x);
    add(static_cast<std::uint32_t>(bits));
    add(static_cast<std::uint32_t>(bits >> 32));
  }
  template <class Real> void add(const BasicHit<Real>& hit) {
    for (const Real x : {hit.t, hit.u, hit.v}) add(x);
    for (const Real x : {hit.normal.x, hit.normal.y, hit.normal.z}) add(x);
    add(hit.error);
    add(hit.geometry);
    add(hit.primitive);
  }
  unsigned long long value() const { return state_; }

 private:
  std::uint64_t state_ = 0xcbf29ce484222325u;
};

build::Bvh must(build::Result<build::Bvh> bvh) {
  if (bvh) return std::move(*bvh);
  std::fprintf(stderr, "%s\n", bvh.error().message.c_str());
  std::exit(2);
}

/// @return rays from inside that leak.
template <class P> unsigned closest(const char* name, const SceneView& scene, const oracle::Mesh& mesh) {
  using Real = typename P::Real;
  Random random(kSeed + 1);
  Digest digest;
  unsigned leaks = 0;
  for (unsigned i = 0; i < 20000; ++i) {
    const auto ray = convert<Real>(aimed(mesh, place(random, 128), random));
    const auto hit = closest_hit<P>(scene, ray);
    leaks += hit.found() ? 0 : 1;
    digest.add(static_cast<const BasicHit<Real>&>(hit));
    if (hit.found()) digest.add(t_error(scene, ray, hit));
  }
  std::printf("%s: closest %016llx\n", name, digest.value());
  if (leaks != 0) std::fprintf(stderr, "%s: %u rays leak\n", name, leaks);
  return leaks;
}

/// @return rays from outside that cross the surface an odd number of times.
unsigned crossings(const SceneView& scene, const oracle::Mesh& mesh) {
  using P = Policies<PlanesLayout, Reference>;
  Random random(kSeed + 2);
  unsigned odd = 0, sum = 0;
  P::Stack::Memory memory;
  for (unsigned i = 0; i < 20000; ++i) {
    Vec3 from = place(random, 8192);
    from.x += 8.0f;
    AllHits<P> query(scene, aimed(mesh, from, random), memory);
    unsigned count = 0;
    while (query.next_hit().found()) ++count;
    odd += count % 2;
    sum += count;
  }
  std::printf("Reference: %u crossings\n", sum);
  if (odd != 0) std::fprintf(stderr, "Reference: %u odd crossings\n", odd);
  return odd;
}

}  // namespace

int main() {
  const oracle::Mesh mesh = lattice_mesh();
  const build::TriangleMesh views[] = {mesh.view()};
  const build::Bvh planes = must(build::build(views)), half = must(build::build(views, {.nodes = NodeLayout::kHalf}));
  const SceneView scene = make_scene_view(*open_buffer(planes.buffer.bytes()));
  unsigned faults = closest<Policies<>>("Watertight", scene, mesh);
  faults +=
      closest<Policies<PlanesLayout, Watertight, Conservative, PrivateStack<>, ArrayLanes>>("ArrayLanes", scene, mesh);
  faults += closest<Policies<HalfLayout>>("half", make_scene_view(*open_buffer(half.buffer.bytes())), mesh);
  faults += closest<Policies<PlanesLayout, Reference>>("Reference", scene, mesh);
  faults += closest<DoubleRays<>>("double", scene, mesh);
  faults += crossings(scene, mesh);
  // One instance where the mesh is, turned by a quarter.
  const std::span<const std::byte> files[] = {planes.buffer.bytes()};
  const build::Instance instances[] = {{.object = 0, .to_scene = {{{0, -1, 0, 0}, {1, 0, 0, 0}, {0, 0, 1, 0}}}}};
  const build::Bvh whole = must(build::build_instances(files, instances));
  faults += closest<Instanced<Policies<>>>("instance", make_scene_view(*open_buffer(whole.buffer.bytes())), mesh);
  return faults == 0 ? 0 : 1;
}
