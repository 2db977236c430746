/// Builds BVHs with every builder that needs no Embree, writes and opens files, and traces rays. It prints a checksum
/// of the hits, which is the same on every machine.

#include <hiprt_build/build.h>
#include <hiprt_build/file.h>
#include <hiprt_build/open_scene.h>
#include <hiprt_device/hiprt_device.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <vector>

namespace {

using namespace hiprt;

/// 0 to 1, from a counter: the same numbers everywhere.
float number(std::uint32_t i) {
  i = (i ^ 61u) ^ (i >> 16);
  i *= 9u;
  i ^= i >> 4;
  i *= 0x27d4eb2du;
  i ^= i >> 15;
  return static_cast<float>(i >> 8) * 0x1p-24f;
}

struct Soup {
  std::vector<build::Position> positions;
  std::vector<build::Triangle> triangles;
  build::TriangleMesh view() const { return {.positions = positions, .triangles = triangles}; }
};

Soup soup(std::uint32_t count) {
  Soup result;
  for (std::uint32_t i = 0; i < count; ++i) {
    for (std::uint32_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t at = 9 * i + 3 * corner;
      const float scale = corner == 0 ? 1.0f : 0.1f;
      const build::Position base = corner == 0 ? build::Position{0, 0, 0} : result.positions[3 * i];
      // A compiler may contract a product and a sum, or not: fma is the same everywhere.
      result.positions.push_back({std::fma(scale, number(at), base[0]), std::fma(scale, number(at + 1), base[1]),
                                  std::fma(scale, number(at + 2), base[2])});
    }
    result.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return result;
}

std::uint64_t trace(const SceneView& scene) {
  std::uint64_t sum = 14695981039346656037u;
  for (std::uint32_t i = 0; i < 20000; ++i) {
    const std::uint32_t at = 1000000 + 6 * i;
    const Ray ray{.origin = {std::fma(number(at), 3.0f, -1.0f), std::fma(number(at + 1), 3.0f, -1.0f),
                             std::fma(number(at + 2), 3.0f, -1.0f)},
                  .direction = {number(at + 3) - 0.5f, number(at + 4) - 0.5f, number(at + 5) - 0.5f}};
    const Hit hit = closest_hit(scene, ray);
    for (const std::uint32_t bits : {std::bit_cast<std::uint32_t>(hit.t), hit.primitive}) {
      sum ^= bits;
      sum *= 1099511628211u;
    }
  }
  return sum;
}

int fail(const char* what, const std::string& why) {
  std::fprintf(stderr, "%s: %s\n", what, why.c_str());
  return 1;
}

}  // namespace

int main() {
  using enum build::Builder;
  const Soup mesh = soup(5000);
  const std::vector<build::TriangleMesh> meshes{mesh.view()};
  const std::filesystem::path path = std::filesystem::temp_directory_path() / "hiprt-smoke.bvh";
  std::uint64_t first = 0;
  for (const build::Builder builder : {kSah, kLbvh, kLbvh30, kPloc, kHploc, kSbvh, kHq}) {
    const auto bvh = build::build(meshes, {.builder = builder});
    if (!bvh) return fail(name(builder), bvh.error().message);
    if (const auto written = build::write_file(path, bvh->buffer.bytes()); !written)
      return fail(name(builder), written.error().message);
    const auto file = open_scene(path.string());
    if (!file) return fail(name(builder), file.error().message);
    const std::uint64_t sum = trace(file->scene());
    std::printf("%-8s %016llx\n", name(builder), static_cast<unsigned long long>(sum));
    if (first == 0) first = sum;
    if (sum != first) return fail(name(builder), "other hits than the first builder");
  }
  std::filesystem::remove(path);
  const auto missing = open_scene(path.string());
  if (missing || missing.error().code != build::ErrorCode::kIo) return fail("a missing file", "was opened");
  constexpr std::uint64_t kHits = 0x51e971e7a4154540;  // On x86-64 Linux.
  return first == kHits ? 0 : fail("hits", "other bits than on x86-64 Linux");
}
