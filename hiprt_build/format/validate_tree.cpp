#include <hiprt_build/format/bit_set.h>
#include <hiprt_build/format/record_checks.h>
#include <hiprt_build/format/validate_quantized.h>
#include <hiprt_build/format/validate_tree.h>

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

namespace hiprt::format_detail {

namespace {

/// Bits for the content below a child.
constexpr std::uint32_t kTrianglesBelow = 1;
constexpr std::uint32_t kCustomBelow = 2;

constexpr std::uint32_t child_flags_of(std::uint32_t below) {
  return kChildOnlyOpaque | (below == kTrianglesBelow ? kChildOnlyTriangles : 0u) |
         (below == kCustomBelow ? kChildOnlyProcedural : 0u);
}

template <class Layout> class TreeCheck {
 public:
  explicit TreeCheck(const BufferView& view)
      : view_(view),
        nodes_(view.node_array<typename Layout::Node>()),
        node_count_(view.node_count()),
        leaves_(view.records<typename Layout::Leaf>(view.leaves)),
        allowed_(allowed(view)),
        slot_(node_count_, kNotReached),
        leaf_reached_(leaves_.size()) {}

  tl::expected<TreeSummary, FormatIssue> run() {
    if (auto root = check_root(); !root) return tl::unexpected(root.error());
    // A node's parent lies before it. So at node i all nodes that can reach i have been visited.
    for (std::uint64_t i = 0; i < node_count_; ++i) {
      if (slot_[i] == kNotReached) return fail(FormatError::kUnreachable, node_offset(i), i, node_count_);
      if (auto node = check_node(i); !node) return tl::unexpected(node.error());
    }
    const std::uint64_t lost = leaf_reached_.first_absent(leaves_.size());
    if (lost != leaves_.size()) return fail(FormatError::kUnreachable, leaf_offset(lost), lost, leaves_.size());
    if (auto features = check_features(); !features) return tl::unexpected(features.error());
    if (auto flags = check_mixed_flags(); !flags) return tl::unexpected(flags.error());
    summary_.depth = fold_upwards([](unsigned, std::uint32_t deepest) { return deepest + 1; });
    summary_.stack_need =
        fold_upwards([](unsigned children, std::uint32_t need_below) { return children - 1 + need_below; });
    return summary_;
  }

 private:
  /// slot_[i] = parent * 4 + child slot. References address fewer than 2^29 nodes, so these marks are not slots.
  static constexpr std::uint32_t kNotReached = 0xffffffffu;
  static constexpr std::uint32_t kRoot = 0xfffffffeu;
  static constexpr std::uint32_t kMixed = kTrianglesBelow | kCustomBelow;
  static constexpr std::uint64_t kHeaderRoot = offsetof(FileHeader, root);

  std::uint64_t node_offset(std::uint64_t i) const { return view_.nodes.offset + nodes_.places().offset(i); }
  std::uint64_t leaf_offset(std::uint64_t i) const { return view_.leaves.offset + i * sizeof(typename Layout::Leaf); }

  Check check_root() {
    const FileHeader& header = *view_.header;
    if (header.root == kInvalidRef) return check_bounds(first_different_plane(header.bounds, empty_box()), empty_box());
    if (auto finite = check_bounds(first_bad_plane(header.bounds), opposite(header.bounds)); !finite) return finite;
    if (auto type = check_type(header.root, kHeaderRoot); !type) return type;
    if (!is_box(header.root)) return check_run(header.root, kHeaderRoot);
    return enter_node(header.root, kHeaderRoot, 0, kRoot);
  }

  Check check_bounds(unsigned plane, const Box& wanted) const {
    if (plane == kNoPlane) return {};
    const std::uint64_t at = offsetof(FileHeader, bounds) + 4 * plane;
    return fail_plane(FormatError::kBadBounds, at, plane, view_.header->bounds, wanted);
  }

  /// The opposite plane of each plane of a box, for messages about inverted boxes.
  static Box opposite(const Box& box) {
    return {{box.max[0], box.max[1], box.max[2]}, {box.min[0], box.min[1], box.min[2]}};
  }

  /// Fails unless a record of the section begins where @p ref says.
  Check check_place(NodeRef ref, std::uint64_t at, const SectionEntry& section) const {
    const std::uint64_t offset = ref_offset(ref), end = section.offset + section.count * section.stride;
    const bool good = is_box(ref)
                          ? view_.has_node(ref)
                          : offset >= section.offset && offset < end && (offset - section.offset) % section.stride == 0;
    if (good) return {};
    return fail(FormatError::kBadReference, at, ref, end);
  }

  /// @param first the smallest node index that is allowed here.
  /// @param slot the value to store for the node.
  Check enter_node(NodeRef ref, std::uint64_t at, std::uint64_t first, std::uint32_t slot) {
    if (auto place = check_place(ref, at, view_.nodes); !place) return place;
    const std::uint64_t number = view_.node_number(ref);
    if (number < first) return fail(FormatError::kReferenceOrder, at, ref_offset(ref), node_offset(first));
    if (slot_[number] != kNotReached) return fail(FormatError::kSharedNode, at, ref_offset(ref), 1);
    slot_[number] = slot;
    return {};
  }

  /// Checks that the type of a reference fits the file's layout and features.
  Check check_type(NodeRef ref, std::uint64_t at) {
    const NodeType type = ref_type(ref);
    if (is_box(ref) ? type != Layout::kBoxType : type != NodeType::kTriangle0 && type != NodeType::kProcedural)
      return fail(FormatError::kBadReference, at, ref, static_cast<std::uint64_t>(Layout::kBoxType));
    if (!is_box(ref)) below_ |= below(ref);
    if ((below_ & ~allowed_) != 0) return check_features();
    return {};
  }

  /// @pre check_type(), and a run's reference.
  static std::uint32_t below(NodeRef ref) {
    return ref_type(ref) == NodeType::kProcedural ? kCustomBelow : kTrianglesBelow;
  }

  /// Checks that kTriangles and kCustom match the runs.
  Check check_features() const {
    if (below_ == allowed_) return {};
    // InstanceCheck checks the content of instances.
    if (view_.has_instances() && below_ == 0) return {};
    const FeatureMask kinds = feature_bit(Feature::kTriangles) | feature_bit(Feature::kCustom);
    FeatureMask expected = view_.header->features & ~kinds;
    if ((below_ & kTrianglesBelow) != 0) expected |= feature_bit(Feature::kTriangles);
    if ((below_ & kCustomBelow) != 0) expected |= feature_bit(Feature::kCustom);
    return fail(FormatError::kFeatureMismatch, offsetof(FileHeader, features), view_.header->features, expected);
  }

  static std::uint32_t allowed(const BufferView& view) {
    if (view.has_instances()) return kCustomBelow;
    const FeatureMask features = view.header->features;
    return ((features & feature_bit(Feature::kTriangles)) != 0 ? kTrianglesBelow : 0u) |
           ((features & feature_bit(Feature::kCustom)) != 0 ? kCustomBelow : 0u);
  }

  /// Checks that the run of leaves at @p ref ends in the section and meets no leaf of another run.
  Check check_run(NodeRef ref, std::uint64_t at) {
    if (auto place = check_place(ref, at, view_.leaves); !place) return place;
    ++summary_.leaf_runs;
    const std::uint64_t first = (ref_offset(ref) - view_.leaves.offset) / view_.leaves.stride;
    for (std::uint64_t leaf = first;; ++leaf) {
      if (leaf == leaves_.size()) return fail(FormatError::kUnterminatedRun, at, leaf - first, leaves_.size());
      if (leaf_reached_.insert(leaf)) return fail(FormatError::kSharedNode, at, leaf_offset(leaf), 1);
      if ((leaves_[leaf].info.geometry_and_flags & kLastInRun) != 0) return {};
    }
  }

  Check check_node(std::uint64_t i) {
    const typename Layout::Node& node = nodes_[i];
    if (auto encoding = check_encoding(node, node_offset(i)); !encoding) return encoding;
    const Box stated = stated_box(i);
    Box content = empty_box();
    unsigned children = 0;
    for (unsigned c = 0; c < kBranching; ++c) {
      if (auto child = check_child(i, c, stated); !child) return child;
      if (node.child[c] != kInvalidRef) ++children;
      grow(content, Layout::box(node, c));
    }
    if (children == 0) return fail(FormatError::kEmptyNode, node_offset(i), 0, 1);
    for (const std::uint32_t& word : reserved_words(node))
      if (word != 0) return fail(FormatError::kBadReservedField, node_offset(i) + offset_in(node, word), word, 0);
    if (slot_[i] != kRoot) return {};
    if constexpr (Layout::kId == NodeLayout::kHalf) content = bounded(content, view_.header->bounds);
    return check_bounds(first_different_plane(view_.header->bounds, content), content);
  }

  static std::uint64_t offset_in(const typename Layout::Node& node, const std::uint32_t& word) {
    return static_cast<std::uint64_t>(reinterpret_cast<const std::byte*>(&word) -
                                      reinterpret_cast<const std::byte*>(&node));
  }

  /// The box that node i's parent states for it: the boxes of its children have to lie inside. check_node() checks the
  /// root's.
  Box stated_box(std::uint64_t i) const {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    if (slot_[i] == kRoot) return {{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
    return Layout::box(nodes_[slot_[i] / kBranching], slot_[i] % kBranching);
  }

  Check check_child(std::uint64_t i, unsigned c, const Box& stated) {
    const typename Layout::Node& node = nodes_[i];
    const NodeRef ref = node.child[c];
    const Box box = Layout::box(node, c);
    const unsigned bad = ref == kInvalidRef                 ? first_different_plane(box, empty_box())
                         : Layout::kId == NodeLayout::kHalf ? first_bad_plane_unbounded(box)
                                                            : first_bad_plane(box);
    if (bad != kNoPlane)
      return fail_plane(FormatError::kBadBox, node_offset(i) + box_offset(Layout{}, c, bad), bad, box,
                        ref == kInvalidRef ? empty_box() : opposite(box));
    const std::uint64_t at = node_offset(i) + offsetof(typename Layout::Node, child) + 4 * c;
    if (ref != kInvalidRef)
      if (auto type = check_type(ref, at); !type) return type;
    // The content below a node is not known yet, unless the file has only one kind: check_mixed_flags().
    if (allowed_ == kTrianglesBelow || allowed_ == kCustomBelow)
      if (auto flags = check_flags(i, c, ref == kInvalidRef ? 0u : child_flags_of(allowed_)); !flags) return flags;
    if (ref == kInvalidRef) return {};
    if (const unsigned outside = first_plane_outside(box, stated); outside != kNoPlane)
      return fail_plane(FormatError::kBoxNotContained, node_offset(i) + box_offset(Layout{}, c, outside), outside, box,
                        stated);
    if (is_box(ref)) return enter_node(ref, at, i + 1, static_cast<std::uint32_t>(i * kBranching + c));
    return check_run(ref, at);
  }

  Check check_flags(std::uint64_t i, unsigned c, std::uint32_t expected) const {
    if constexpr (Layout::kHasChildFlags) {
      const std::uint32_t flags = nodes_[i].child_flags >> (8 * c) & 0xffu;
      if (flags != expected)
        return fail(FormatError::kBadChildFlags, node_offset(i) + offsetof(typename Layout::Node, child_flags) + c,
                    flags, expected);
    }
    return {};
  }

  /// Checks the flags of a file with both kinds of leaves, from the last node to the first. slot_ stores what is
  /// below.
  Check check_mixed_flags() {
    if (allowed_ != kMixed || !Layout::kHasChildFlags) return {};
    for (std::uint64_t i = node_count_; i-- > 0;) {
      std::uint32_t all = 0;
      for (unsigned c = 0; c < kBranching; ++c) {
        const NodeRef ref = nodes_[i].child[c];
        const std::uint32_t here = ref == kInvalidRef ? 0u : is_box(ref) ? slot_[view_.node_number(ref)] : below(ref);
        if (auto flags = check_flags(i, c, ref == kInvalidRef ? 0u : child_flags_of(here)); !flags) return flags;
        all |= here;
      }
      slot_[i] = all;
    }
    return {};
  }

  /// Computes a number per node from the largest number of its children (leaves: 0), from the last node to the first.
  /// slot_ stores the numbers.
  /// @return the root's number.
  template <class Combine> std::uint32_t fold_upwards(Combine combine) {
    for (std::uint64_t i = node_count_; i-- > 0;) {
      std::uint32_t largest = 0;
      unsigned children = 0;
      for (const NodeRef ref : nodes_[i].child) {
        if (ref == kInvalidRef) continue;
        ++children;
        if (is_box(ref)) largest = std::max(largest, slot_[view_.node_number(ref)]);
      }
      slot_[i] = combine(children, largest);
    }
    return slot_.empty() ? 0 : slot_[0];
  }

  const BufferView& view_;
  NodeArray<const typename Layout::Node> nodes_;
  std::uint64_t node_count_;
  std::span<const typename Layout::Leaf> leaves_;
  std::uint32_t allowed_;    ///< Kinds of leaves of the header's features.
  std::uint32_t below_ = 0;  ///< Kinds of leaves that were found.
  std::vector<std::uint32_t> slot_;
  BitSet leaf_reached_;
  TreeSummary summary_;
};

}  // namespace

tl::expected<TreeSummary, FormatIssue> check_tree(const BufferView& view) {
  return dispatch_layout(view.layout(), [&](auto layout) { return TreeCheck<decltype(layout)>(view).run(); });
}

}  // namespace hiprt::format_detail
