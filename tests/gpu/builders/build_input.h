#pragma once
/// Scenes that device and host build, and the checks of the files.

#include <hiprt_build/format/validate.h>
#include <hiprt_build/gpu/build.h>
#include <tests/gpu/counting_allocator.h>
#include <tests/gpu/results.h>
#include <tests/oracle/meshes.h>
#include <tests/traversal/every_hit.h>

#include <vector>

namespace hiprt::checks {

constexpr std::uint64_t kSeed = 20261121;

/// Geometries on the host, and copies of them on the device.
class Input {
 public:
  explicit Input(std::vector<oracle::Mesh> meshes, std::vector<std::vector<Box>> boxes = {})
      : meshes_(std::move(meshes)), boxes_(std::move(boxes)) {
    for (const oracle::Mesh& mesh : meshes_) {
      positions_.push_back(must(gpu::DeviceArray<build::Position>::from(mesh.positions, nullptr, allocator_)));
      triangles_.push_back(must(gpu::DeviceArray<build::Triangle>::from(mesh.triangles, nullptr, allocator_)));
      geometries.push_back({.positions = positions_.back().data(),
                            .triangles = triangles_.back().data(),
                            .position_count = static_cast<std::uint32_t>(mesh.positions.size()),
                            .primitive_count = static_cast<std::uint32_t>(mesh.triangles.size()),
                            .mask = mesh.mask});
    }
    for (const std::vector<Box>& custom : boxes_) {
      device_boxes_.push_back(must(gpu::DeviceArray<Box>::from(custom, nullptr, allocator_)));
      // Without boxes any address says that these are custom primitives.
      const Box* data = custom.empty() ? device_boxes_.front().data() : device_boxes_.back().data();
      geometries.push_back({.boxes = data,
                            .primitive_count = static_cast<std::uint32_t>(custom.size()),
                            .type = static_cast<std::uint8_t>(device_boxes_.size())});
    }
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
  }

  build::Buffer build_on_device(const gpu::BuildOptions& options, gpu::BuildReport* report = nullptr) {
    const gpu::BuiltScene scene = must(gpu::build_scene(geometries, options, nullptr, allocator_));
    if (report != nullptr) *report = scene.report;
    return must(gpu::download_file(scene, "test_build", nullptr));
  }
  build::Bvh build_on_host(const build::BuildOptions& options) const {
    const std::vector<build::TriangleMesh> views = oracle::views(meshes_);
    std::vector<build::CustomGeometry> customs;
    for (const std::vector<Box>& custom : boxes_)
      customs.push_back({.boxes = custom, .type = static_cast<std::uint8_t>(customs.size() + 1)});
    return must(build::build(build::SceneInput{views, customs}, options));
  }

  std::vector<gpu::DeviceGeometry> geometries;

 private:
  CountingAllocator allocator_;
  std::vector<oracle::Mesh> meshes_;
  std::vector<std::vector<Box>> boxes_;
  std::vector<gpu::DeviceArray<build::Position>> positions_;
  std::vector<gpu::DeviceArray<build::Triangle>> triangles_;
  std::vector<gpu::DeviceArray<Box>> device_boxes_;
};

inline BufferView checked_view(const build::Buffer& file) {
  const auto summary = validate(file.bytes());
  INFO((summary ? std::string() : to_string(summary.error())));
  REQUIRE(summary.has_value());
  return *open_buffer(file.bytes());
}

inline std::span<const std::byte> section(const build::Buffer& file, SectionKind kind) {
  const auto* entries = reinterpret_cast<const SectionEntry*>(file.bytes().data() + sizeof(FileHeader));
  const SectionEntry& entry = entries[static_cast<unsigned>(kind) - 1];
  return file.bytes().subspan(entry.offset, entry.count * entry.stride);
}

/// The files are equal, except for provenance and checksum.
inline void check_same_files(const build::Buffer& device, const build::Buffer& host) {
  checked_view(device);
  for (const SectionKind kind :
       {SectionKind::kNodes, SectionKind::kLeaves, SectionKind::kPrimitiveMap, SectionKind::kGeometries}) {
    INFO("section " << static_cast<unsigned>(kind));
    const auto a = section(device, kind), b = section(host, kind);
    REQUIRE(a.size() == b.size());
    CHECK(std::equal(a.begin(), a.end(), b.begin()));
  }
  const auto& a = *reinterpret_cast<const FileHeader*>(device.bytes().data());
  const auto& b = *reinterpret_cast<const FileHeader*>(host.bytes().data());
  CHECK(a.root == b.root);
  CHECK(a.features == b.features);
  CHECK(a.stack_bound == b.stack_bound);
  CHECK(std::equal(a.bounds.min, a.bounds.min + 3, b.bounds.min));
  CHECK(std::equal(a.bounds.max, a.bounds.max + 3, b.bounds.max));
}

/// Closest hits of rays to points at all distances from the origin, bit for bit. @return how many there are.
inline unsigned check_hits(const SceneView& scene, const std::vector<oracle::Mesh>& meshes) {
  oracle::Random random(kSeed);
  unsigned found = 0;
  for (unsigned i = 0; i < 300; ++i) {
    const oracle::Position from = random.in_cube(2), to = random.in_cube(random.log_uniform(1e-3, 1));
    const Ray ray{.origin = vec3(from), .direction = vec3(to) - vec3(from)};
    const std::vector<Hit> all = every_hit(meshes, ray);
    const Hit expected = all.empty() ? Hit{} : all[0], hit = closest_hit(scene, ray);
    INFO("ray " << i << ": t = " << hit.t << ", expected " << expected.t);
    REQUIRE(same_hit(hit, expected));
    found += hit.found() ? 1 : 0;
  }
  return found;
}

}  // namespace hiprt::checks
