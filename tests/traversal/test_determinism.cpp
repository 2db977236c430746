// The same input gives the same file, byte for byte, with any number of threads.

#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/scenes.h>
#include <tests/traversal/workers.h>

#include <hiprt_build/exec/threads.h>
#include <tests/catch.h>

#include <algorithm>
#include <cstring>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr bool kSlow = kWorkDivisor > 3;

std::string bytes_of(const std::vector<Mesh>& meshes, const build::BuildOptions& options) {
  const auto views = oracle::views(meshes);
  const auto bvh = build::build(views, options);
  REQUIRE(bvh.has_value());
  const auto bytes = bvh->buffer.bytes();
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::vector<std::vector<Mesh>> inputs() {
  return {{},
          {identical(1)},
          {icosphere(5)},
          {star(kSlow ? 4 : 5, 1), soup(trials(60000), 0.05, 2), identical(kSlow ? 1000 : 3000)},
          {concentric(kSlow ? 1000 : 5000, 3)},
          {torture(5000, 4), needles(5000, 1e6, 5)},
          {scattered(icosphere(kSlow ? 4 : 6), 6), scattered(grid_plane(kSlow ? 51 : 101, 1, 0), 7)}};
}

}  // namespace

TEST_CASE("our builders' files do not depend on the number of threads", "[determinism]") {
  // More threads than the machine may have, so that they are interrupted at any point.
  constexpr unsigned kMost = kSlow ? 4 : 8;
  const build::Threads::Limit workers(kMost);
  std::size_t number = 0;
  for (const std::vector<Mesh>& meshes : inputs()) {
    CAPTURE(number++);
    const auto check = [&](build::BuildOptions options) {
      CAPTURE(build::name(options.builder));
      options.threads = 1;
      const std::string one = bytes_of(meshes, options);
      for (const unsigned threads : {2u, kMost}) {
        // Slow builds have time for the larger number only.
        if (kSlow && threads == 2) continue;
        CAPTURE(threads);
        options.threads = threads;
        REQUIRE((bytes_of(meshes, options) == one));
      }
    };
    check({.nodes = NodeLayout::kFloat});
    for (const build::Builder builder :
         {build::Builder::kSah, build::Builder::kLbvh, build::Builder::kLbvh30, build::Builder::kPloc,
          build::Builder::kHploc, build::Builder::kSbvh, build::Builder::kHq})
      check({.builder = builder});
  }
}

TEST_CASE("builds that run at the same time do not disturb each other", "[determinism]") {
  const std::vector<Mesh> meshes{star(4, 1), soup(trials(20000), 0.05, 2)};
  const std::string alone = bytes_of(meshes, {});
  const auto different = for_each_parallel<int>(8, [&](std::size_t i, int& count) {
    const auto views = oracle::views(meshes);
    const auto bvh = build::build(views, {.threads = static_cast<unsigned>(i % 3)});
    if (!bvh || bvh->buffer.size() != alone.size() ||
        std::memcmp(bvh->buffer.bytes().data(), alone.data(), alone.size()) != 0)
      ++count;
  });
  for (const int count : different) CHECK(count == 0);
}
