// Refits on the device: the files equal those of the host's refit, bit for bit.

#include <hiprt_build/format/validate.h>
#include <hiprt_build/gpu/refit.h>
#include <hiprt_build/refit.h>
#include <hiprt_build/statistics.h>
#include <hiprt_device/format/widened_boxes.h>
#include <tests/gpu/counting_allocator.h>
#include <tests/gpu/results.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <algorithm>
#include <cmath>

using namespace hiprt;
using namespace hiprt::checks;
using gpu::RefitStatus;

namespace {

constexpr std::uint64_t kSeed = 20261121;

/// A scene on the device and its file on the host.
class Scene {
 public:
  Scene(std::vector<oracle::Mesh> meshes, NodeLayout nodes, bool pair = true) : meshes_(std::move(meshes)) {
    file_ = must(build::build(oracle::views(meshes_),
                              {.nodes = nodes, .pair_triangles = pair, .widen_boxes = may_be_widened(nodes)}))
                .buffer;
    view_.emplace(*open_buffer(std::as_const(file_).bytes()));
    scene_.emplace(must(gpu::upload_scene(*view_, nullptr, allocator_)));
    parts_ = gpu::parts_of(*scene_, *view_);
    scratch_ = must(gpu::DeviceBuffer::make(gpu::refit_scratch(parts_), nullptr, allocator_));
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
  }

  std::vector<oracle::Mesh>& meshes() { return meshes_; }
  build::Buffer& file() { return file_; }

  gpu::RefitReport refit() {
    positions_.clear();
    triangles_.clear();
    std::vector<gpu::DeviceGeometry> moved;
    for (const oracle::Mesh& mesh : meshes_) {
      positions_.push_back(must(gpu::DeviceArray<build::Position>::from(mesh.positions, nullptr, allocator_)));
      triangles_.push_back(must(gpu::DeviceArray<build::Triangle>::from(mesh.triangles, nullptr, allocator_)));
      moved.push_back({.positions = positions_.back().data(),
                       .triangles = triangles_.back().data(),
                       .position_count = static_cast<std::uint32_t>(mesh.positions.size()),
                       .primitive_count = static_cast<std::uint32_t>(mesh.triangles.size())});
    }
    return read(must(gpu::enqueue_refit(parts_, moved, scratch_.data(), nullptr)));
  }
  gpu::RefitReport measure() { return read(must(gpu::enqueue_quality(parts_, scratch_.data(), nullptr))); }

  std::vector<std::byte> download() {
    std::vector<std::byte> bytes(scene_->buffer.size());
    must(scene_->buffer.download(bytes, nullptr));
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
    return bytes;
  }

 private:
  static gpu::RefitReport read(const gpu::RefitReport* report) {
    gpu::RefitReport result;
    REQUIRE(hipMemcpy(&result, report, sizeof(result), hipMemcpyDeviceToHost) == hipSuccess);
    return result;
  }

  CountingAllocator allocator_;
  std::vector<oracle::Mesh> meshes_;
  build::Buffer file_;
  std::optional<BufferView> view_;
  std::optional<gpu::DeviceScene> scene_;
  gpu::SceneParts parts_;
  gpu::DeviceBuffer scratch_;
  std::vector<gpu::DeviceArray<build::Position>> positions_;
  std::vector<gpu::DeviceArray<build::Triangle>> triangles_;
};

void twist(oracle::Mesh& mesh, float turn) {
  for (build::Position& p : mesh.positions) {
    const float angle = turn * p[2], x = p[0], y = p[1];
    p[0] = x * std::cos(angle) - y * std::sin(angle);
    p[1] = x * std::sin(angle) + y * std::cos(angle);
  }
}

/// Everything but the checksum and the provenance.
void check_same(const std::vector<std::byte>& device, std::span<const std::byte> host) {
  REQUIRE(device.size() == host.size());
  const auto* sections = reinterpret_cast<const SectionEntry*>(host.data() + sizeof(FileHeader));
  const std::size_t end = sections[4].offset;
  const std::size_t checksum = offsetof(FileHeader, checksum);
  CHECK(std::equal(device.begin(), device.begin() + checksum, host.begin()));
  CHECK(std::equal(device.begin() + checksum + 8, device.begin() + static_cast<std::ptrdiff_t>(end),
                   host.begin() + checksum + 8));
}

constexpr NodeLayout kLayouts[] = {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized};

}  // namespace

TEST_CASE("refits of the device equal the host's, in every layout") {
  INFO("seed " << kSeed);
  for (const NodeLayout nodes : kLayouts) {
    INFO("layout " << static_cast<unsigned>(nodes));
    Scene scene({oracle::star(3, kSeed), oracle::torus(30, 20, 0.3), oracle::soup(1, 0.1, kSeed)}, nodes);
    const double slack_built = scene.measure().exchange_slack;
    for (const float turn : {0.0f, 0.5f, 3.0f}) {
      for (oracle::Mesh& mesh : scene.meshes()) twist(mesh, turn);
      const gpu::RefitReport report = scene.refit();
      REQUIRE(report.status == RefitStatus::kOk);
      const build::RefitStatistics host = must(build::refit(scene.file().bytes(), {oracle::views(scene.meshes()), {}}));
      check_same(scene.download(), scene.file().bytes());
      CHECK(report.sah_cost == Approx(host.sah_cost).epsilon(1e-9));
      CHECK(report.exchange_slack == Approx(host.exchange_slack).epsilon(1e-9));
      CHECK(slack_built == Approx(host.exchange_slack_built).margin(1e-6));  // Six digits in the file.
      CHECK(report.view.bounds.min[0] == open_buffer(scene.file().bytes())->header->bounds.min[0]);
    }
  }
}

TEST_CASE("a scene that the device has built is refitted there") {
  CountingAllocator allocator;
  oracle::Mesh mesh = oracle::star(3, kSeed);
  const auto triangles = must(gpu::DeviceArray<build::Triangle>::from(mesh.triangles, nullptr, allocator));
  const auto geometry = [&](const gpu::DeviceArray<build::Position>& positions) {
    return gpu::DeviceGeometry{.positions = positions.data(),
                               .triangles = triangles.data(),
                               .position_count = static_cast<std::uint32_t>(positions.size()),
                               .primitive_count = static_cast<std::uint32_t>(triangles.size())};
  };
  const auto before = must(gpu::DeviceArray<build::Position>::from(mesh.positions, nullptr, allocator));
  const gpu::DeviceGeometry built_from = geometry(before);
  gpu::BuiltScene scene = must(gpu::build_scene({&built_from, 1}, {}, nullptr, allocator));
  build::Buffer file = must(gpu::download_file(scene, "test", nullptr));
  twist(mesh, 2);
  const auto after = must(gpu::DeviceArray<build::Position>::from(mesh.positions, nullptr, allocator));
  const gpu::DeviceGeometry moved = geometry(after);
  const gpu::SceneParts parts = gpu::parts_of(scene);
  auto scratch = must(gpu::DeviceBuffer::make(gpu::refit_scratch(parts), nullptr, allocator));
  must(gpu::enqueue_refit(parts, {&moved, 1}, scratch.data(), nullptr));
  const build::Buffer refitted = must(gpu::download_file(scene, "test", nullptr));
  must(build::refit(file.bytes(), {oracle::views({mesh}), {}}));
  CHECK(std::ranges::equal(refitted.bytes(), std::as_const(file).bytes()));
}

TEST_CASE("small scenes are refitted on the device") {
  for (const std::size_t count : {0u, 1u, 2u, 3u, 9u}) {
    INFO(count << " triangles");
    oracle::Mesh mesh = oracle::soup(10, 0.2, kSeed);
    mesh = oracle::first_triangles(mesh, count);
    Scene scene({mesh}, NodeLayout::kPlanes);
    twist(scene.meshes()[0], 1);
    CHECK(scene.refit().status == RefitStatus::kOk);
    must(build::refit(scene.file().bytes(), {oracle::views(scene.meshes()), {}}));
    check_same(scene.download(), scene.file().bytes());
  }
}

TEST_CASE("scenes that cannot be refitted stay as they were") {
  Scene scene({oracle::star(2, kSeed), oracle::torus(12, 10, 0.3)}, NodeLayout::kPlanes);
  const std::vector<std::byte> before = scene.download();
  const std::vector<oracle::Mesh> good = scene.meshes();
  const auto status = [&] {
    const RefitStatus result = scene.refit().status;
    CHECK(scene.download() == before);
    scene.meshes() = good;
    return result;
  };
  scene.meshes()[1].positions[3][1] = std::numeric_limits<float>::quiet_NaN();
  CHECK(status() == RefitStatus::kNotFinite);
  scene.meshes()[0].triangles[7][2] = 100000;
  CHECK(status() == RefitStatus::kBadIndex);
  scene.meshes()[0].triangles.pop_back();
  CHECK(status() == RefitStatus::kOtherScene);
  // Every triangle has its own corners, and one corner moves.
  oracle::Mesh apart;
  for (const build::Triangle& t : good[1].triangles)
    oracle::append(apart, good[1].positions[t[0]], good[1].positions[t[1]], good[1].positions[t[2]]);
  for (std::size_t i = 0; i < apart.positions.size(); i += 3)
    apart.positions[i][0] += 1e-3f * static_cast<float>(i % 7);
  scene.meshes()[1] = apart;
  CHECK(status() == RefitStatus::kComeApart);
  // One that can be refitted changes as on the host: boxes of split triangles grow.
  CHECK(scene.refit().status == RefitStatus::kOk);
  must(build::refit(scene.file().bytes(), {oracle::views(scene.meshes()), {}}));
  check_same(scene.download(), scene.file().bytes());
}
