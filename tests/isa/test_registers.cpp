// Traversals leave the upper halves of vector registers clean. Otherwise later code for SSE, which is most code of most
// programs, takes several times as long on many processors: each instruction has to keep the dirty halves.

#include <hiprt_build/build.h>
#include <hiprt_build/trace_rays.h>
#include <tests/oracle/random.h>
#include <tools/render/tracers/tracer.h>

#include <tests/catch.h>

#include <cpuid.h>

#include <cstdint>
#include <cstdio>
#include <limits>
#include <vector>

using namespace hiprt;

namespace {

constexpr std::uint32_t kUpperHalves = 4;  ///< Bit of the state AVX: bits 128 to 255.

/// Whether the processor tells which registers are in use (XGETBV with ECX = 1).
bool can_tell() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  constexpr unsigned kOsXsave = 1u << 27, kAvx = 1u << 28, kTellsUse = 1u << 2;
  if (__get_cpuid(1, &a, &b, &c, &d) == 0 || (c & kOsXsave) == 0 || (c & kAvx) == 0) return false;
  return __get_cpuid_count(0xd, 1, &a, &b, &c, &d) != 0 && (a & kTellsUse) != 0;
}

std::uint32_t registers_in_use() {
  std::uint32_t low = 0, high = 0;
  __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(1));
  return low;
}

void clean() { __asm__ volatile("vzeroupper"); }

/// Whether @p work leaves them clean.
template <class Work> bool stays_clean(const Work& work) {
  clean();
  work();
  const std::uint32_t used = registers_in_use();
  clean();
  return (used & kUpperHalves) == 0;
}

build::Bvh soup(oracle::Random& random) {
  std::vector<build::Position> positions(3000);
  std::vector<build::Triangle> triangles(1000);
  for (build::Position& p : positions) {
    const auto at = random.in_cube(1.0);
    p = {static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2])};
  }
  for (std::uint32_t i = 0; i < triangles.size(); ++i) triangles[i] = {3 * i, 3 * i + 1, 3 * i + 2};
  auto bvh = build::build(std::vector{build::TriangleMesh{.positions = positions, .triangles = triangles}});
  REQUIRE(bvh);
  return std::move(*bvh);
}

}  // namespace

TEST_CASE("registers: no traversal leaves the upper halves in use") {
  if (!can_tell()) {
    std::puts("SKIPPED: this processor does not tell which registers are in use");
    return;
  }
  // The test sees a fault.
  CHECK_FALSE(stays_clean([] {
    __asm__ volatile("vpcmpeqd %%xmm0, %%xmm0, %%xmm0\n vinsertf128 $1, %%xmm0, %%ymm0, %%ymm0" : : : "xmm0");
  }));
  const std::uint64_t seed = 20261128;
  oracle::Random random(seed);
  const build::Bvh bvh = soup(random);
  const SceneView prepared = bvh.scene();
  SceneView plain = prepared;
  plain.host = nullptr;
  std::vector<Ray> rays(500);
  for (Ray& ray : rays) {
    const auto from = random.in_cube(2.0), to = random.in_cube(1.0);
    ray.origin = Vec3(from[0], from[1], from[2]);
    ray.direction = Vec3(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
  }
  std::vector<Hit> hits(rays.size());
  CHECK(stays_clean([&] { static_cast<void>(closest_hits(prepared, rays, hits)); }));
  CHECK(stays_clean([&] { static_cast<void>(any_hits(prepared, rays, hits)); }));
  CHECK(stays_clean([&] { static_cast<void>(closest_hits(prepared, std::span(rays).first(1), hits)); }));
  for (const tools::Query query : {tools::Query::kClosest, tools::Query::kAny}) {
    CHECK(stays_clean([&] { tools::trace(prepared, query, {}, rays, hits); }));
    CHECK(stays_clean([&] { tools::trace(plain, query, {}, rays, hits); }));
    const tools::TracePolicies reference{.triangle_test = tools::TriangleTestKind::kReference};
    CHECK(stays_clean([&] { tools::trace(plain, query, reference, rays, hits); }));
  }
}
