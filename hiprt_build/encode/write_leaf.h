#pragma once
/// Leaf records of a file. Internal.

#include <hiprt_build/input/leaf.h>
#include <hiprt_device/format/layout.h>

namespace hiprt::build {

template <class Layout> struct LeafWriter {
  using Leaf = typename Layout::Leaf;

  GeometryTable geometries;
  Leaf* leaves;

  /// Writes record @p at. @param last whether it ends a run. @param box becomes the box of the primitives. (As a
  /// result it would take more registers.)
  HIPRT_HD void write(std::uint32_t at, const LeafPrimitives& leaf, bool last, Box& box) const {
    const std::uint32_t g = geometries.find(leaf.primitive);
    const GeometryView& geometry = geometries[g];
    const std::uint32_t first = leaf.primitive - geometry.first;
    const LeafContents contents = leaf.contents;
    const LeafInfo info{{first, contents.is_pair() ? first + contents.distance() : kInvalidId},
                        g | (last ? kLastInRun : 0u),
                        contents.is_custom()
                            ? TriangleId::kCustom * (contents.is_pair() ? 0x101u : 1u)
                            : TriangleId::from_rotation(contents.rotation0()) |
                                  (contents.is_pair() ? TriangleId::from_rotation(contents.rotation1()) << 8 : 0u)};
    box = empty_box();
    if (contents.is_custom())
      write_custom(at, geometry, info, box);
    else
      write_triangles(at, leaf_corners(geometry, first, contents), info, box);
  }

 private:
  HIPRT_HD void write_triangles(std::uint32_t at, const LeafCorners& corners, const LeafInfo& info, Box& box) const {
    Leaf record{};
    for (unsigned v = 0; v < 4; ++v) {
      grow(box, corners.v[v]);
      for (unsigned axis = 0; axis < 3; ++axis) Layout::set_coordinate(record, v, axis, corners.v[v].x[axis]);
    }
    record.info = info;
    leaves[at] = record;
  }
  HIPRT_HD void write_custom(std::uint32_t at, const GeometryView& customs, const LeafInfo& info, Box& box) const {
    const Box first = customs.box(info.primitive[0]);
    const Box second = info.primitive[1] == kInvalidId ? empty_box() : customs.box(info.primitive[1]);
    static_assert(sizeof(Leaf) == sizeof(CustomLeaf));
    *reinterpret_cast<CustomLeaf*>(leaves + at) = CustomLeaf{{first, second}, info};
    grow(box, first);
    if (info.primitive[1] != kInvalidId) grow(box, second);
  }
};

}  // namespace hiprt::build
