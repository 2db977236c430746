// Mutants of BVH files on a GPU: what validate() accepts is traced, and the hits equal the host's, bit for bit.

#include <tests/gpu/mutants.h>

#include <hiprt_build/format/validate.h>
#include <hiprt_build/gpu/scene.h>
#include <tests/fuzz/mutate.h>
#include <tests/fuzz/rays.h>
#include <tests/fuzz/seed_files.h>

#include <tests/catch.h>

#include <array>
#include <bit>
#include <cstdlib>
#include <utility>
#include <vector>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

/// Files that validate() accepts, and rays of each.
struct Mutants {
  std::vector<test::TestFile> files;
  std::vector<Ray> rays;
  std::vector<SceneView> scenes;  ///< On the host.
  unsigned tried = 0, with_instances = 0;
};

bool has_customs(const BufferView& view) { return (view.header->features & feature_bit(Feature::kCustom)) != 0; }

/// @param wanted number of files. Half of them have instances.
Mutants make_mutants(std::uint64_t seed, unsigned wanted) {
  fuzz::Random random(seed);
  std::vector<test::TestFile> flat, instanced;
  for (const test::TestFile& file : fuzz::make_bvh_files()) {
    const auto view = open_buffer(file.bytes());
    REQUIRE(view.has_value());
    if (view->layout() == NodeLayout::kPlanes && !has_customs(*view))
      (view->has_instances() ? instanced : flat).push_back(file);
  }
  REQUIRE((!flat.empty() && !instanced.empty()));
  Mutants mutants;
  while (mutants.files.size() < wanted) {
    ++mutants.tried;
    const bool with_instances = mutants.files.size() % 2 == 1;
    auto& seeds = with_instances ? instanced : flat;
    test::TestFile file = seeds[random.below(seeds.size())];
    for (std::uint64_t changes = 1 + random.below(4); changes > 0; --changes) fuzz::mutate(file, random);
    file.seal();
    const auto summary = validate(file.bytes());
    if (!summary) continue;
    const BufferView view = *open_buffer(file.bytes());
    // What the kernel is compiled for.
    if (view.layout() != NodeLayout::kPlanes || has_customs(view) || view.header->levels > kMutantLevels ||
        view.header->stack_bound + 3 > kMutantStack || view.has_instances() != with_instances)
      continue;
    mutants.with_instances += with_instances ? 1 : 0;
    mutants.files.push_back(std::move(file));
  }
  for (const test::TestFile& file : mutants.files) {
    mutants.scenes.push_back(make_scene_view(*open_buffer(file.bytes())));
    fuzz::RaySource rays(mutants.scenes.back().bounds, random.bits());
    for (unsigned i = 0; i < kMutantRays; ++i) mutants.rays.push_back(rays.next());
  }
  return mutants;
}

bool same_bits(const MutantHit& a, const MutantHit& b) {
  const auto bits = [](const MutantHit& result) {
    const Hit& hit = result.hit;
    const std::array<float, 7> numbers{hit.t, hit.u, hit.v, hit.normal.x, hit.normal.y, hit.normal.z, hit.error};
    return std::bit_cast<std::array<std::uint32_t, 7>>(numbers);
  };
  return a.hit.geometry == b.hit.geometry && a.hit.primitive == b.hit.primitive && a.instance == b.instance &&
         bits(a) == bits(b);
}

}  // namespace

TEST_CASE("mutants that validate() accepts have the host's hits") {
  // HIPRT_MUTANTS: another number of files, for a longer run.
  const char* const wanted = std::getenv("HIPRT_MUTANTS");
  const auto count = static_cast<unsigned>(wanted != nullptr ? std::strtoul(wanted, nullptr, 10) : 400);
  constexpr std::uint64_t kSeed = 34;
  const Mutants mutants = make_mutants(kSeed, count);

  gpu::DeviceAllocator allocator;
  std::vector<gpu::DeviceScene> uploaded;
  std::vector<SceneView> on_device;
  for (const test::TestFile& file : mutants.files) {
    // Each file has a separate allocation: a check for accesses out of bounds sees where it ends.
    auto scene = gpu::upload_scene(file.bytes(), nullptr, allocator);
    REQUIRE(scene.has_value());
    uploaded.push_back(std::move(*scene));
    on_device.push_back(uploaded.back().view);
  }
  const auto traced = trace_mutants_on_device(on_device, mutants.rays);
  INFO((traced ? "" : traced.error().message));
  REQUIRE(traced.has_value());
  const std::vector<MutantHit>& hits = *traced;
  const auto expected = trace_mutants(mutants.scenes, mutants.rays);
  unsigned found = 0, failed = 0, different = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    found += hits[i].hit.found() ? 1 : 0;
    failed += hits[i].hit.failed() ? 1 : 0;
    different += same_bits(hits[i], expected[i]) ? 0 : 1;
  }
  WARN("seed " << kSeed << ": " << mutants.tried << " mutants, " << mutants.files.size() << " accepted, of these "
               << mutants.with_instances << " with instances; " << hits.size() << " rays, " << found << " hits");
  CHECK(found > hits.size() / 50);
  CHECK(failed == 0);
  CHECK(different == 0);
}
