#include <hiprt_build/format/bit_set.h>
#include <hiprt_build/format/leaf_walk.h>
#include <hiprt_build/format/record_checks.h>
#include <hiprt_build/format/validate_primitives.h>
#include <hiprt_device/format/widened_boxes.h>

#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

namespace hiprt::format_detail {

namespace {

template <class Layout> class PrimitiveCheck {
 public:
  explicit PrimitiveCheck(const BufferView& view)
      : view_(view),
        leaves_(view.records<Leaf>(view.leaves)),
        margin_(view.header->box_margin),
        splits_allowed_((view.header->features & feature_bit(Feature::kSplitReferences)) != 0),
        reached_(view.primitive_map.size()),
        mapped_(view.primitive_map.size()),
        split_(view.primitive_map.size()) {}

  tl::expected<PrimitiveSummary, FormatIssue> run() {
    auto leaves = for_each_leaf<Layout>(
        view_, [this](const LeafVisit& visit) { return visit.custom ? check_custom_leaf(visit) : check_leaf(visit); });
    if (!leaves) return tl::unexpected(leaves.error());
    if (auto map = check_map(); !map) return tl::unexpected(map.error());
    if (splits_allowed_)
      if (auto splits = check_splits(); !splits) return tl::unexpected(splits.error());
    return summary_;
  }

 private:
  using Leaf = typename Layout::Leaf;
  static constexpr std::uint64_t kInfo = offsetof(FloatLeaf, info);

  std::uint64_t leaf_offset(std::uint64_t leaf) const { return view_.leaves.offset + leaf * sizeof(Leaf); }
  /// Number of a leaf's primitive over all geometries. @pre check_ids() accepted the leaf.
  std::uint64_t number(const Leaf& leaf, unsigned triangle) const {
    return view_.geometries[leaf.info.geometry_and_flags & kGeometryMask].first_primitive +
           leaf.info.primitive[triangle];
  }
  /// Whether the leaf has a triangle or custom primitive @p which. A leaf of instances has one; its other number is
  /// entered_ref().
  bool has_primitive(const Leaf& leaf, unsigned which) const {
    return which == 0 || (!view_.has_instances() && leaf.info.primitive[1] != kInvalidId);
  }

  /// Checks the two primitives of a leaf. A loop would make clang-tidy 21 report that a tl::expected is undefined.
  template <class Function> static Check check_both(Function&& check) {
    if (auto first = check(0u); !first) return first;
    return check(1u);
  }

  Check check_leaf(const LeafVisit& visit) {
    const std::uint64_t index = visit.index;
    if (auto ids = check_ids<false>(index); !ids) return ids;
    if (auto triangle_ids = check_triangle_ids<false>(index); !triangle_ids) return triangle_ids;
    if (auto vertices = check_vertices(index); !vertices) return vertices;
    // Whether a triangle may leave the box is known only after all leaves have been visited: check_splits().
    if (!splits_allowed_) {
      auto inside = check_both([&](unsigned triangle) { return check_inside(index, triangle, visit.box); });
      if (!inside) return inside;
    }
    return check_both([&](unsigned triangle) { return count_reference<false>(index, triangle); });
  }

  Check check_custom_leaf(const LeafVisit& visit) {
    if (auto ids = check_ids<true>(visit.index); !ids) return ids;
    if (auto id_bytes = check_triangle_ids<true>(visit.index); !id_bytes) return id_bytes;
    auto boxes = check_both([&](unsigned which) { return check_custom_box(visit, which); });
    if (!boxes) return boxes;
    return check_both([&](unsigned which) { return count_reference<true>(visit.index, which); });
  }

  /// Checks that a custom primitive's box is valid and inside the box that is stated for the run.
  Check check_custom_box(const LeafVisit& visit, unsigned which) const {
    const bool present = has_primitive(leaves_[visit.index], which);
    const Box& box = custom_leaf(leaves_[visit.index]).box[which];
    const std::uint64_t at = leaf_offset(visit.index) + offsetof(CustomLeaf, box) + sizeof(Box) * which;
    // InstanceCheck checks moving boxes.
    if (view_.has_moving_boxes()) return {};
    const unsigned bad = present ? first_bad_plane(box) : first_different_plane(box, empty_box());
    if (bad != kNoPlane)
      return fail_plane(FormatError::kBadBox, at + 4 * bad, bad, box, present ? visit.box : empty_box());
    const unsigned outside = present ? first_plane_outside(widened(box, margin_), visit.box) : kNoPlane;
    if (outside == kNoPlane) return {};
    return fail_plane(FormatError::kBoxNotContained, at + 4 * outside, outside, widened(box, margin_), visit.box);
  }

  /// @tparam kCustom whether the leaf is a custom one.
  template <bool kCustom> Check check_ids(std::uint64_t index) const {
    const LeafInfo& info = leaves_[index].info;
    const std::uint64_t at = leaf_offset(index) + kInfo;
    const std::uint32_t unused = info.geometry_and_flags & ~(kLastInRun | kGeometryMask);
    if (unused != 0)
      return fail(FormatError::kBadReservedField, at + 8, info.geometry_and_flags, kLastInRun | kGeometryMask);
    const std::uint32_t geometry = info.geometry_and_flags & kGeometryMask;
    if (geometry >= view_.geometries.size())
      return fail(FormatError::kBadGeometryId, at + 8, geometry, view_.geometries.size());
    if (((view_.geometries[geometry].flags & kGeometryCustom) != 0) != kCustom)
      return fail(FormatError::kBadGeometryId, at + 8, geometry, view_.geometries.size());
    const std::uint64_t primitives = view_.geometries[geometry].primitive_count;
    for (unsigned triangle = 0; triangle < 2; ++triangle)
      if (has_primitive(leaves_[index], triangle) && info.primitive[triangle] >= primitives)
        return fail(FormatError::kBadPrimitiveId, at + 4 * triangle, info.primitive[triangle], primitives);
    return {};
  }

  template <bool kCustom> Check check_triangle_ids(std::uint64_t index) const {
    const LeafInfo& info = leaves_[index].info;
    const std::uint64_t at = leaf_offset(index) + kInfo + offsetof(LeafInfo, triangle_ids);
    for (unsigned triangle = 0; triangle < 2; ++triangle) {
      const std::uint32_t id = info.triangle_ids >> (8 * triangle) & 0xffu;
      const bool present = has_primitive(leaves_[index], triangle);
      const bool good = kCustom ? id == TriangleId::kCustom : is_rotation(id);
      const std::uint32_t wanted = kCustom ? TriangleId::kCustom : TriangleId::from_rotation(0);
      if (present ? !good : id != 0) return fail(FormatError::kBadTriangleId, at + triangle, id, present ? wanted : 0);
    }
    if (info.triangle_ids >> 16 != 0) return fail(FormatError::kBadReservedField, at + 2, info.triangle_ids >> 16, 0);
    return {};
  }

  Check check_vertices(std::uint64_t index) const {
    const Leaf& leaf = leaves_[index];
    for (unsigned vertex = 0; vertex < 4; ++vertex)
      for (unsigned axis = 0; axis < 3; ++axis) {
        const float here = Layout::coordinate(leaf, vertex, axis);
        const std::uint64_t at = leaf_offset(index) + coordinate_offset<Layout>(vertex, axis);
        if (!std::isfinite(here))
          return fail_float(FormatError::kBadVertex, at, here, std::numeric_limits<float>::max());
        const float v2 = Layout::coordinate(leaf, 2, axis);
        if (vertex == 3 && !has_primitive(leaf, 1) && float_bits(here) != float_bits(v2))
          return fail_float(FormatError::kBadVertex, at, here, v2);
      }
    return {};
  }

  Check check_inside(std::uint64_t index, unsigned triangle, const Box& box) const {
    for (unsigned corner = 0; corner < 3; ++corner)
      for (unsigned axis = 0; axis < 3; ++axis) {
        const unsigned vertex = corner_vertex(triangle, corner);
        const float here = Layout::coordinate(leaves_[index], vertex, axis);
        const float low = here - margin_, high = here + margin_;
        if (box.min[axis] <= low && high <= box.max[axis]) continue;
        const bool below = low < box.min[axis];
        return fail_float(FormatError::kBoxNotContained, leaf_offset(index) + coordinate_offset<Layout>(vertex, axis),
                          below ? low : high, below ? box.min[axis] : box.max[axis]);
      }
    return {};
  }

  static bool is_rotation(std::uint32_t id) {
    return id == TriangleId::from_rotation(0) || id == TriangleId::from_rotation(1) ||
           id == TriangleId::from_rotation(2);
  }

  template <bool kCustom> Check count_reference(std::uint64_t index, unsigned triangle) {
    const Leaf& leaf = leaves_[index];
    if (!has_primitive(leaf, triangle)) return {};
    const std::uint64_t primitive = number(leaf, triangle);
    ++(kCustom ? summary_.leaf_customs : summary_.leaf_triangles);
    if (view_.primitive_map[primitive] == index * 2 + triangle) mapped_.insert(primitive);
    if (!reached_.insert(primitive) || view_.has_instances()) return {};
    if (kCustom || !splits_allowed_)
      return fail(kCustom ? FormatError::kSplitCustom : FormatError::kSplitWithoutFeature,
                  leaf_offset(index) + kInfo + 4 * triangle, leaf.info.primitive[triangle], 1);
    split_.insert(primitive);
    return {};
  }

  /// Checks the map: it names one of the references of each reached primitive, and says that the others are dropped.
  Check check_map() {
    for (std::uint64_t g = 0; g < view_.geometries.size(); ++g) {
      const GeometryRecord& geometry = view_.geometries[g];
      std::uint64_t dropped = 0;
      for (std::uint64_t p = geometry.first_primitive; p < geometry.first_primitive + geometry.primitive_count; ++p) {
        const bool reached = reached_.test(p);
        if (reached ? !mapped_.test(p) : view_.primitive_map[p] != kInvalidId)
          return fail(FormatError::kPrimitiveMapMismatch, view_.primitive_map_entry.offset + 4 * p,
                      view_.primitive_map[p], reached ? 2 * leaves_.size() : kInvalidId);
        if (!reached) ++dropped;
      }
      if (dropped != geometry.dropped_count)
        return fail(FormatError::kDroppedCount, view_.geometry_entry.offset + g * sizeof(GeometryRecord) + 16,
                    geometry.dropped_count, dropped);
      summary_.dropped += dropped;
    }
    return {};
  }

  /// Checks that whole primitives lie in their box. The boxes of a split primitive must cover it, and its copies be
  /// equal.
  Check check_splits() {
    summary_.split = split_.count();
    split_.index();
    std::vector<Box> covered(static_cast<std::size_t>(summary_.split), empty_box());
    auto visited = for_each_leaf<Layout>(view_, [&](const LeafVisit& visit) -> Check {
      const auto& [leaf, custom, box] = visit;
      for (unsigned triangle = 0; triangle < 2 && !custom; ++triangle) {
        if (!has_primitive(leaves_[leaf], triangle)) continue;
        const std::uint64_t primitive = number(leaves_[leaf], triangle);
        auto good = split_.test(primitive) ? check_copy(leaf, triangle) : check_inside(leaf, triangle, box);
        if (!good) return good;
        if (split_.test(primitive))
          grow(covered[split_.rank(primitive)],
               intersection(box, bounds_of(leaf_triangle<Layout>(leaves_[leaf], triangle))));
      }
      return {};
    });
    if (!visited) return visited;
    for (std::uint64_t p = 0; p < view_.primitive_map.size(); ++p)
      if (split_.test(p))
        if (auto good = check_covered(p, covered[split_.rank(p)]); !good) return good;
    return {};
  }

  /// The corners in the mesh's order: copies with different rotations have the same.
  static std::array<float, 9> mesh_corners(const Leaf& leaf, unsigned triangle) {
    const std::uint32_t id = leaf.info.triangle_ids >> (8 * triangle) & 0xffu;
    const unsigned source[3] = {3 - TriangleId::u_source(id) - TriangleId::v_source(id), TriangleId::u_source(id),
                                TriangleId::v_source(id)};
    const Corners corners = leaf_triangle<Layout>(leaf, triangle);
    std::array<float, 9> result{};
    for (unsigned i = 0; i < 9; ++i) result[i] = corners.corner[source[i / 3]][i % 3];
    return result;
  }

  Check check_copy(std::uint64_t index, unsigned triangle) const {
    const std::uint32_t original = view_.primitive_map[number(leaves_[index], triangle)];
    const auto here = mesh_corners(leaves_[index], triangle);
    const auto there = mesh_corners(leaves_[original / 2], original % 2);
    for (unsigned i = 0; i < 9; ++i)
      if (float_bits(here[i]) != float_bits(there[i]))
        return fail_float(FormatError::kSplitDiffers, leaf_offset(index), here[i], there[i]);
    return {};
  }

  Check check_covered(std::uint64_t primitive, const Box& covered) const {
    const std::uint32_t original = view_.primitive_map[primitive];
    const Box bounds = bounds_of(leaf_triangle<Layout>(leaves_[original / 2], original % 2));
    const unsigned plane = first_plane_outside(bounds, covered);
    if (plane == kNoPlane) return {};
    const std::uint64_t at = leaf_offset(original / 2) + kInfo + 4 * (original % 2);
    return fail_plane(FormatError::kSplitNotCovered, at, plane, covered, bounds);
  }

  const BufferView& view_;
  std::span<const Leaf> leaves_;
  float margin_;  ///< By how much a box must exceed its content.
  bool splits_allowed_;
  BitSet reached_, mapped_, split_;
  PrimitiveSummary summary_;
};

}  // namespace

tl::expected<PrimitiveSummary, FormatIssue> check_primitives(const BufferView& view) {
  return dispatch_layout(view.layout(), [&](auto layout) { return PrimitiveCheck<decltype(layout)>(view).run(); });
}

}  // namespace hiprt::format_detail
