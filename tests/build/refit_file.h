#pragma once
/// A built file that tests of refits move, with the checks after a valid and after an invalid refit.

#include <hiprt_build/format/validate.h>
#include <hiprt_build/refit.h>
#include <tests/build/tight_boxes.h>
#include <tests/oracle/mesh.h>

#include <tests/catch.h>

#include <string>
#include <vector>

namespace hiprt::test {

inline constexpr NodeLayout kLayouts[] = {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf,
                                          NodeLayout::kQuantized};
inline constexpr std::uint64_t kSeed = 4711;

/// A built file.
struct File {
  build::Bvh bvh;

  std::span<std::byte> bytes() { return bvh.buffer.bytes(); }
  std::string copy() { return {reinterpret_cast<const char*>(bytes().data()), bytes().size()}; }
  BufferView view() {
    const auto view = open_buffer(bytes());
    REQUIRE(view);
    return *view;
  }
  bool has_splits() { return (view().header->features & feature_bit(Feature::kSplitReferences)) != 0; }
};

inline void check_valid(std::span<const std::byte> bytes) {
  const auto valid = validate(bytes);
  INFO((valid ? "" : to_string(valid.error())));
  REQUIRE(valid);
}

inline File built(const build::SceneInput& scene, const build::BuildOptions& options = {}) {
  auto bvh = build::build(scene, options);
  INFO((bvh ? "" : bvh.error().message));
  REQUIRE(bvh.has_value());
  return {std::move(*bvh)};
}
inline File built(const oracle::Mesh& mesh, const build::BuildOptions& options = {}) {
  const std::vector meshes{mesh.view()};
  return built(build::SceneInput{meshes, {}}, options);
}

inline build::RefitStatistics refitted(File& file, const build::SceneInput& moved,
                                       const build::RefitOptions& options = {}) {
  const auto result = build::refit(file.bytes(), moved, options);
  INFO((result ? "" : result.error().message));
  REQUIRE(result.has_value());
  check_valid(file.bytes());
  return *result;
}
inline build::RefitStatistics refitted(File& file, const oracle::Mesh& moved, const build::RefitOptions& options = {}) {
  const std::vector meshes{moved.view()};
  return refitted(file, build::SceneInput{meshes, {}}, options);
}

/// A refused refit leaves the file unchanged.
inline build::Error refusal(File& file, const build::SceneInput& moved, const build::RefitOptions& options = {}) {
  const std::string before = file.copy();
  const auto result = build::refit(file.bytes(), moved, options);
  REQUIRE_FALSE(result.has_value());
  CHECK((file.copy() == before));
  const auto copied = build::refit_copy(file.bytes(), moved, options);
  REQUIRE_FALSE(copied.has_value());
  CHECK(copied.error().message == result.error().message);
  CHECK(result.error().message.find('\n') == std::string::npos);
  return result.error();
}
inline build::Error refusal(File& file, const oracle::Mesh& moved) {
  const std::vector meshes{moved.view()};
  return refusal(file, build::SceneInput{meshes, {}});
}

/// Every triangle of every leaf has, in the order that its id byte says, the mesh's corners.
template <class Layout> unsigned wrong_corners(const BufferView& view, const oracle::Mesh& mesh) {
  unsigned wrong = 0;
  for (const auto& leaf : view.records<typename Layout::Leaf>(view.leaves))
    for (unsigned which = 0; which < (leaf.info.primitive[1] == kInvalidId ? 1u : 2u); ++which) {
      const std::uint32_t id = leaf.info.triangle_ids >> (8 * which) & 0xffu;
      const unsigned u = TriangleId::u_source(id), v = TriangleId::v_source(id), source[] = {3 - u - v, u, v};
      const auto corners = format_detail::leaf_triangle<Layout>(leaf, which);
      const oracle::Triangle& triangle = mesh.triangles[leaf.info.primitive[which]];
      for (unsigned k = 0; k < 3; ++k)
        for (unsigned axis = 0; axis < 3; ++axis)
          wrong += corners.corner[source[k]][axis] == mesh.positions[triangle[k]][axis] ? 0 : 1;
    }
  return wrong;
}

inline void check_moved(File& file, const oracle::Mesh& moved) {
  const BufferView view = file.view();
  CHECK(dispatch_layout(view.layout(), [&](auto layout) { return wrong_corners<decltype(layout)>(view, moved); }) == 0);
  if (!file.has_splits()) check_tight_boxes(view);
}

}  // namespace hiprt::test
