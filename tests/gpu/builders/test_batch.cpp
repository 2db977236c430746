// Batches of many small BVHs: each gives the hits of the host's build.

#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/batch.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/gpu/counting_allocator.h>
#include <tests/gpu/results.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <numeric>

using namespace hiprt;
using namespace hiprt::checks;
using Catch::Matchers::Contains;

namespace {

constexpr std::uint64_t kSeed = 20261121;

/// Meshes in one array, and their BVHs.
class Batch {
 public:
  explicit Batch(const std::vector<oracle::Mesh>& meshes) : meshes_(meshes) {
    for (const oracle::Mesh& mesh : meshes) {
      oracle::append(all_, mesh);
      first_.push_back(static_cast<std::uint32_t>(all_.triangles.size()));
    }
    positions_ = must(gpu::DeviceArray<build::Position>::from(all_.positions, nullptr, allocator_));
    triangles_ = must(gpu::DeviceArray<build::Triangle>::from(all_.triangles, nullptr, allocator_));
    device_first_ = must(gpu::DeviceArray<std::uint32_t>::from(first_, nullptr, allocator_));
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
  }

  gpu::DeviceBatch input() const {
    return {positions_.data(), triangles_.data(), static_cast<std::uint32_t>(all_.positions.size()), first_,
            device_first_.data()};
  }

  gpu::BatchReport build(const gpu::BuildOptions& options) {
    const gpu::BuildSizes sizes = must(gpu::batch_sizes(input(), options));
    auto output = must(gpu::DeviceBuffer::make(sizes.output, nullptr, allocator_));
    auto scratch = must(gpu::DeviceBuffer::make(sizes.scratch, nullptr, allocator_));
    must(output.fill(std::byte{0xa5}, nullptr));
    const gpu::BatchScenes scenes = must(gpu::enqueue_batch(input(), options, output.data(), scratch.data(), nullptr));
    bytes_.resize(sizes.output + 256);
    base_ = bytes_.data() + (256 - reinterpret_cast<std::uintptr_t>(bytes_.data()) % 256) % 256;
    must(output.download({base_, sizes.output}, nullptr));
    REQUIRE(hipDeviceSynchronize() == hipSuccess);
    const std::byte* device = output.data();
    const auto on_host = [&](const auto* pointer) {
      using T = std::remove_reference_t<decltype(*pointer)>;
      return reinterpret_cast<T*>(base_ + (reinterpret_cast<const std::byte*>(pointer) - device));
    };
    views_.assign(on_host(scenes.views), on_host(scenes.views) + meshes_.size());
    for (SceneView& view : views_) {
      view.base = on_host(view.base);
      view.geometries = on_host(view.geometries);
    }
    return *on_host(scenes.report);
  }

  /// Rays through each mesh, traced in both trees.
  void check_hits(std::uint64_t seed) const {
    oracle::Random random(seed);
    std::size_t hits = 0;
    for (std::size_t m = 0; m < meshes_.size(); ++m) {
      INFO("mesh " << m << ", " << meshes_[m].triangles.size() << " triangles");
      const build::Bvh host = must(build::build(oracle::views({meshes_[m]}), {.builder = build::Builder::kSah}));
      const SceneView view = make_scene_view(*open_buffer(host.buffer.bytes()));
      for (int i = 0; i < 40; ++i) {
        const oracle::Position from = random.in_cube(3), to = random.in_cube(0.8);
        const Ray ray{.origin = {from[0], from[1], from[2]},
                      .direction = {to[0] - from[0], to[1] - from[1], to[2] - from[2]}};
        const Hit wanted = closest_hit(view, ray), got = closest_hit(views_[m], ray);
        REQUIRE(got.t == wanted.t);
        REQUIRE(got.geometry == wanted.geometry);
        REQUIRE(got.primitive == wanted.primitive);
        hits += wanted.primitive != kInvalidId ? 1 : 0;
      }
    }
    CHECK(hits > meshes_.size());
  }

  const std::vector<SceneView>& views() const { return views_; }

 private:
  CountingAllocator allocator_;
  std::vector<oracle::Mesh> meshes_;
  oracle::Mesh all_;
  std::vector<std::uint32_t> first_{0};
  gpu::DeviceArray<build::Position> positions_;
  gpu::DeviceArray<build::Triangle> triangles_;
  gpu::DeviceArray<std::uint32_t> device_first_;
  std::vector<std::byte> bytes_;
  std::byte* base_ = nullptr;
  std::vector<SceneView> views_;
};

}  // namespace

TEST_CASE("a batch of any mixture of sizes") {
  INFO("seed " << kSeed);
  std::vector<oracle::Mesh> meshes;
  for (const unsigned count : {0u, 1u, 2u, 3u, 8u, 31u, 32u, 33u, 64u, 100u, 255u, 256u, 257u, 700u, 0u, 5u})
    meshes.push_back(count == 0 ? oracle::Mesh{} : oracle::soup(count, 0.4, kSeed + count));
  meshes.push_back(oracle::star(2, kSeed));
  meshes.push_back(oracle::torus(10, 8, 0.3));
  Batch batch(meshes);
  for (const build::Builder builder : {build::Builder::kLbvh, build::Builder::kHploc}) {
    const gpu::BatchReport report = batch.build({.builder = builder});
    CHECK(report.bad_indices == 0);
    CHECK(report.too_deep == 0);
    batch.check_hits(kSeed);
  }
}

TEST_CASE("a batch with trees too deep for a ray's stack, which LBVH rebuilds") {
  Batch batch({oracle::soup(20, 0.4, kSeed), oracle::nested(200, kSeed), oracle::nested(256, kSeed),
               oracle::nested(130, kSeed), oracle::nested(300, kSeed)});
  const gpu::BatchReport report = batch.build({.builder = build::Builder::kHploc});
  CHECK(report.too_deep == 0);
  for (const SceneView& view : batch.views()) {
    CHECK(view.root != kInvalidRef);
    CHECK(view.stack_bound <= 180);
  }
  CHECK(batch.views()[3].stack_bound > 120);
  batch.check_hits(kSeed);
}

TEST_CASE("broken triangles in a batch are dropped and counted") {
  std::vector<oracle::Mesh> meshes{oracle::torture(60, kSeed), oracle::identical(40), oracle::concentric(50, kSeed)};
  Batch batch(meshes);
  const gpu::BatchReport report = batch.build({});
  std::uint32_t not_finite = 0, degenerate = 0;
  for (const oracle::Mesh& mesh : meshes) {
    const build::Bvh host = must(build::build(oracle::views({mesh})));
    not_finite += static_cast<std::uint32_t>(host.statistics.dropped_not_finite);
    degenerate += static_cast<std::uint32_t>(host.statistics.dropped_degenerate);
  }
  CHECK(not_finite > 0);
  CHECK(report.dropped_not_finite == not_finite);
  CHECK(report.dropped_degenerate == degenerate);
}

TEST_CASE("invalid batches are refused") {
  const auto message = [](const gpu::DeviceBatch& batch, const gpu::BuildOptions& options) {
    return error_of(gpu::batch_sizes(batch, options)).message;
  };
  const std::vector<std::uint32_t> one{0, 1}, falling{0, 5, 3}, late{1, 2};
  CHECK_THAT(message({}, {}), Contains("first must begin with 0"));
  CHECK_THAT(message({.first = late}, {}), Contains("first must begin with 0"));
  CHECK_THAT(message({.first = falling}, {}), Contains("first[1] is 5, first[2] only 3"));
  CHECK_THAT(message({.first = one}, {}), Contains("must not be nullptr"));
  CHECK_THAT(message({.first = one}, {.nodes = NodeLayout::kFloat}), Contains("layout planes only"));
  CHECK_THAT(message({.first = one}, {.builder = build::Builder::kSbvh}), Contains("not by sbvh"));
  CHECK_THAT(message({.first = one}, {.presplit_budget = 2}), Contains("neither cuts nor rounds"));
}
