// The hits of a GPU are the host's, bit for bit.

#include <hiprt_build/file.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/gpu/kernels.h>
#include <tests/gpu/random_scene.h>
#include <tests/gpu/recorder.h>
#include <tests/gpu/results.h>

#include <bit>
#include <cstdio>
#include <cstdlib>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kRaySeed = 31;
constexpr unsigned kRays = 20000;

/// The files of make_scenes, of the seed HIPRT_GPU_SCENE_SEED; the environment names another folder, where the program
/// runs away from its build.
build::Buffer scene_file(const char* name) {
  const char* folder = std::getenv("HIPRT_GPU_SCENES");
  return must(build::map_file(std::filesystem::path(folder != nullptr ? folder : HIPRT_GPU_SCENES) / name));
}

std::string text(const Hit& hit) {
  char line[256];
  std::snprintf(line, sizeof line, "t %a u %a v %a geometry %u primitive %u normal %a %a %a error %a",
                static_cast<double>(hit.t), static_cast<double>(hit.u), static_cast<double>(hit.v), hit.geometry,
                hit.primitive, static_cast<double>(hit.normal.x), static_cast<double>(hit.normal.y),
                static_cast<double>(hit.normal.z), static_cast<double>(hit.error));
  return line;
}

std::string text(const Ray& ray) {
  char line[256];
  std::snprintf(line, sizeof line, "origin %a %a %a direction %a %a %a tmin %a tmax %a mask %u",
                static_cast<double>(ray.origin.x), static_cast<double>(ray.origin.y), static_cast<double>(ray.origin.z),
                static_cast<double>(ray.direction.x), static_cast<double>(ray.direction.y),
                static_cast<double>(ray.direction.z), static_cast<double>(ray.tmin), static_cast<double>(ray.tmax),
                ray.mask);
  return line;
}

std::vector<Ray> rays_at(const std::vector<oracle::Mesh>& meshes) {
  oracle::Random random(kRaySeed);
  std::vector<Ray> rays(kRays);
  for (Ray& ray : rays) ray = random_ray(meshes, random);
  return rays;
}

using Kernel = void (*)(SceneView, const Ray*, Hit*, unsigned);
using Query = Hit (*)(const SceneView&, const Ray&);

/// Compares every ray's hit; prints how many rays hit and what the first differences are.
void compare(const char* name, Kernel kernel, Query query) {
  INFO("scene " << name << ", scene seed " << HIPRT_GPU_SCENE_SEED << ", ray seed " << kRaySeed);
  const build::Buffer file = scene_file(name);
  const SceneView host = make_scene_view(*open_buffer(file.bytes()));
  const std::vector<Ray> rays = rays_at(random_meshes(HIPRT_GPU_SCENE_SEED));
  const Stream stream;
  gpu::DeviceAllocator allocator;
  const gpu::DeviceScene scene = must(gpu::upload_scene(file.bytes(), stream, allocator));
  const auto device_rays = must(gpu::DeviceArray<Ray>::from(rays, stream, allocator));
  auto device_hits = must(gpu::DeviceArray<Hit>::make(kRays, stream, allocator));
  must(gpu::launch(kernel, kRays, stream, {.block = 64}, scene.view, device_rays.data(), device_hits.data(), kRays));
  const std::vector<Hit> hits = must(device_hits.to_vector(stream));
  unsigned found = 0, differences = 0;
  for (unsigned i = 0; i < kRays; ++i) {
    const Hit expected = query(host, rays[i]);
    REQUIRE_FALSE(expected.failed());
    if (expected.found()) ++found;
    // %a shows every bit of a number that is not NaN.
    if (text(hits[i]) == text(expected)) continue;
    if (++differences <= 5)
      std::printf("ray %u: %s\n  GPU  %s\n  host %s\n", i, text(rays[i]).c_str(), text(hits[i]).c_str(),
                  text(expected).c_str());
  }
  std::printf("%s, scene seed %llu, ray seed %llu: %u of %u rays hit, %u differences\n", name,
              static_cast<unsigned long long>(HIPRT_GPU_SCENE_SEED), static_cast<unsigned long long>(kRaySeed), found,
              kRays, differences);
  CHECK(found > kRays / 4);
  CHECK(found < kRays);
  CHECK(differences == 0);
}

}  // namespace

TEST_CASE("closest hits are the host's") {
  compare("planes.bvh", closest_hits, &closest_hit);
  compare("float.bvh", closest_hits, &closest_hit);
}

TEST_CASE("any hits are the host's") {
  compare("planes.bvh", any_hits, &any_hit);
  compare("float.bvh", any_hits, &any_hit);
}
