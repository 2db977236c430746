// A run of leaves below one node slot holds at most max_leaf_triangles triangles, and the builder uses that limit.

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/format/layout.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/catch.h>

#include <algorithm>

using namespace hiprt;
using namespace hiprt::oracle;

namespace {

/// @return the triangles of the largest run.
unsigned largest_run(const BufferView& view) {
  unsigned largest = 0, run = 0;
  const std::byte* base = view.bytes.data() + view.leaves.offset;
  for (std::uint64_t i = 0; i < view.leaves.count; ++i) {
    const auto& leaf = *reinterpret_cast<const FloatLeaf*>(base + i * sizeof(FloatLeaf));
    run += leaf.info.primitive[1] == kInvalidId ? 1 : 2;
    largest = std::max(largest, run);
    if ((leaf.info.geometry_and_flags & kLastInRun) != 0) run = 0;
  }
  CHECK(run == 0);
  return largest;
}

}  // namespace

TEST_CASE("a run of leaves has at most max_leaf_triangles triangles") {
  constexpr std::uint64_t kSeed = 23;
  INFO("seed " << kSeed);
  const std::vector<Mesh> meshes{soup(500, 0.3, kSeed), icosphere(3)};
  for (const build::Builder builder : {build::Builder::kSah, build::Builder::kLbvh, build::Builder::kHq,
                                       oracle::kEmbreeLow, oracle::kEmbreeMedium, oracle::kEmbreeHigh})
    for (const bool pairs : {true, false})
      for (const unsigned limit : {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u, 13u}) {
        // Box nodes so dear that runs are as long as they may be.
        const auto bvh = build::build(oracle::views(meshes), {.builder = builder,
                                                              .nodes = NodeLayout::kFloat,
                                                              .max_leaf_triangles = limit,
                                                              .pair_triangles = pairs,
                                                              .costs = {.box_node = 1000, .leaf = 0.01f}});
        REQUIRE(bvh.has_value());
        const auto view = open_buffer(bvh->buffer.bytes());
        REQUIRE(view.has_value());
        CAPTURE(build::name(builder), pairs, limit);
        CHECK(largest_run(*view) == limit);
      }
}
