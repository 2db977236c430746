// Morton codes and their sort.

#include <hiprt_build/exec/radix_sort.h>
#include <hiprt_build/lbvh_ploc/morton.h>
#include <tests/build/machine.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/catch.h>

#include <numeric>

using namespace hiprt;
using namespace hiprt::oracle;
using namespace hiprt::build;

TEST_CASE("spread bits and Morton codes match their definitions") {
  Random random(1);
  for (int round = 0; round < 1000; ++round) {
    const std::uint32_t x = random.below(1u << 21);
    std::uint64_t wanted = 0;
    for (unsigned bit = 0; bit < 21; ++bit) wanted |= std::uint64_t{x >> bit & 1u} << (3 * bit);
    REQUIRE(spread_bits(x) == wanted);
  }
  CHECK(spread_bits(0x1fffff) == 0x1249249249249249u);
  const Box centers{{0, 0, 0}, {1, 0.5f, 0}};
  for (const unsigned bits : {kMortonBits30, kMortonBits63}) {
    const MortonGrid grid = MortonGrid::over(centers, bits);
    // Centres are halved: those of [0, 4] are at 1.
    CHECK(grid.code(box_at({0, 0, 0}, {0, 0, 0})) == 0);
    CHECK(grid.cell(box_at({0, 0, 0}, {4, 2, 0}), 0) == (1u << bits) - 1);
    CHECK(grid.cell(box_at({0, 0, 0}, {4, 2, 0}), 1) == 1u << (bits - 1));
    CHECK(grid.code(box_at({1, 1, 0}, {0, 0, 0})) == std::uint64_t{3} << (3 * bits - 2));
  }
}

TEST_CASE("the Morton grid accepts every finite box") {
  constexpr float kMost = std::numeric_limits<float>::max(), kLeast = std::numeric_limits<float>::denorm_min();
  for (const float extent : {0.0f, kLeast, 0x1p-126f, 0x1p-100f, 1e-20f, 1.0f, 1e20f, kMost}) {
    const Box all = box_at({-extent, -extent, -extent}, {0, 0, 0});
    Box centers = empty_box();
    const std::vector<Box> boxes{all, box_at({extent, 0, -extent}, {0, 0, 0}),
                                 Box{{-extent, 0, 0}, {extent, 0, extent}}};
    for (const Box& box : boxes)
      for (unsigned axis = 0; axis < 3; ++axis) {
        centers.min[axis] = std::min(centers.min[axis], split_position(box, axis));
        centers.max[axis] = std::max(centers.max[axis], split_position(box, axis));
      }
    const MortonGrid grid = MortonGrid::over(centers, kMortonBits63);
    CAPTURE(extent);
    CHECK(std::isfinite(grid.cells_per_unit));
    for (const Box& box : boxes)
      for (unsigned axis = 0; axis < 3; ++axis) CHECK(grid.cell(box, axis) <= (1u << kMortonBits63) - 1);
    CHECK(grid.cell(boxes[0], 0) == 0);
    if (extent > 1e-20f) CHECK(grid.cell(boxes[1], 0) == (1u << kMortonBits63) - 1);
  }
}

TEST_CASE("the radix sort is stable, for every number of digits and chunks") {
  Machine machine;
  constexpr std::uint64_t kSeed = 2;
  Random random(kSeed);
  INFO("seed " << kSeed);
  for (const std::size_t count :
       {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{1000}, RadixSort::kChunk - 1, RadixSort::kChunk,
        RadixSort::kChunk + 1, 3 * RadixSort::kChunk + 7})
    for (const unsigned bits : {1u, 8u, 9u, 30u, 63u}) {
      std::vector<std::uint64_t> keys;
      std::vector<std::uint32_t> values(count);
      for (std::size_t i = 0; i < count; ++i) {
        const std::uint64_t key = std::uint64_t{random.below(1u << 31)} << 32 | random.below(1u << 31) << 1;
        keys.push_back(key >> (64 - bits));
      }
      std::iota(values.begin(), values.end(), 0u);
      std::vector<std::uint32_t> wanted = values;
      std::stable_sort(wanted.begin(), wanted.end(),
                       [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
      std::vector<std::uint64_t> sorted = keys;
      radix_sort(machine.engine, sorted, values, bits);
      CAPTURE(count, bits);
      REQUIRE((values == wanted));
      REQUIRE(std::is_sorted(sorted.begin(), sorted.end()));
    }
}
