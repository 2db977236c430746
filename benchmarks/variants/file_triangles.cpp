#include "file_triangles.h"

#include <hiprt_build/format/leaf_walk.h>

#include <array>
#include <limits>

namespace hiprt::bench {
namespace {

/// Corners of a leaf's triangles (node.h).
constexpr std::array<std::array<unsigned, 3>, 2> kCorners{{{0, 1, 2}, {1, 3, 2}}};

template <class Layout> void read_leaves(const BufferView& file, std::vector<build::Position>& corners) {
  const auto leaves = file.records<typename Layout::Leaf>(file.leaves);
  const auto read = [&](const format_detail::LeafVisit& visit) -> format_detail::Check {
    if (visit.custom) return {};
    const auto& leaf = leaves[static_cast<std::size_t>(visit.index)];
    const std::uint64_t first = file.geometries[leaf.info.geometry_and_flags & kGeometryMask].first_primitive;
    for (unsigned k = 0; k < kCorners.size(); ++k) {
      if (leaf.info.primitive[k] == kInvalidId) continue;
      const auto number = static_cast<std::size_t>(first + leaf.info.primitive[k]);
      for (unsigned corner = 0; corner < 3; ++corner)
        for (unsigned axis = 0; axis < 3; ++axis)
          corners[3 * number + corner][axis] = Layout::coordinate(leaf, kCorners[k][corner], axis);
    }
    return {};
  };
  static_cast<void>(format_detail::for_each_leaf<Layout>(file, read));
}

}  // namespace

std::vector<build::Position> file_triangles(const BufferView& file) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  std::vector<build::Position> corners(3 * static_cast<std::size_t>(file.header->primitive_count),
                                       build::Position{kNaN, kNaN, kNaN});
  dispatch_layout(file.layout(), [&](auto layout) { read_leaves<decltype(layout)>(file, corners); });
  return corners;
}

}  // namespace hiprt::bench
