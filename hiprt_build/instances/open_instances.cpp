#include <hiprt_build/format/view.h>
#include <hiprt_build/instances/open_instances.h>

#include <algorithm>
#include <queue>

namespace hiprt::build {
namespace {

/// The share of @p box that lies inside @p other. A flat box has shares of the axes in which it is not flat.
double share_inside(const Box& box, const Box& other) {
  double share = 1.0;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const double common = double{std::min(box.max[axis], other.max[axis])} -
                          double{std::max(box.min[axis], other.min[axis])},
                 size = double{box.max[axis]} - double{box.min[axis]};
    if (common < 0.0) return 0.0;
    if (size > 0.0) share *= common / size;
  }
  return share;
}

/// By how much the areas of a part's children may sum to more than its own. The numbers were chosen by the steps of
/// rays in five scenes: an island, a town, crowns apart and in each other, rooms in chunks of triangles
/// (decisions/0014).
double tolerated_excess(double overlap) { return std::clamp(0.1 * (overlap - 2.0), 0.0, 1.0); }

template <class Layout> class OverlapMeter {
 public:
  explicit OverlapMeter(const BufferView& tree) : base_(tree.bytes.data()) {}

  /// Adds the overlap of the boxes below @p ref.
  void visit(NodeRef ref, const Box& box, std::vector<float>& overlap) {
    if (!is_box(ref)) {
      double sum = 0.0;
      for (const Beside& other : beside_) {
        const double share = share_inside(box, other.box);
        sum += share;
        if (!is_box(other.ref)) overlap[number(other.ref)] += static_cast<float>(share);
      }
      overlap[number(ref)] += static_cast<float>(sum);
      return;
    }
    const auto& node = *reinterpret_cast<const typename Layout::Node*>(base_ + ref_offset(ref));
    const std::size_t above = beside_.size();
    for (unsigned c = 0; c < kBranching; ++c) {
      if (node.child[c] == kInvalidRef) continue;
      const Box part = Layout::box(node, c);
      for (unsigned other = 0; other < kBranching; ++other)
        if (other != c && node.child[other] != kInvalidRef)
          beside_.push_back({Layout::box(node, other), node.child[other]});
      visit(node.child[c], part, overlap);
      beside_.resize(above);
    }
  }

 private:
  struct Beside {
    Box box;
    NodeRef ref;
  };

  std::uint32_t number(NodeRef leaf) const {
    return reinterpret_cast<const CustomLeaf*>(base_ + ref_offset(leaf))->info.primitive[0];
  }

  const std::byte* base_;
  std::vector<Beside> beside_;  ///< Siblings of the nodes on the path.
};

/// Which parts to open next, most gain first.
class Opening {
 public:
  Opening(CpuEngine& engine, PartBoxes& boxes, std::span<const float> overlap)
      : engine_(engine), boxes_(boxes), group_(boxes.group()), overlap_(overlap) {
    std::vector<std::size_t> all(group_.parts.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
    offer(all);
  }

  /// A pass fills an eighth of the remaining capacity, so that all threads compute boxes. Which parts are opened
  /// depends little on this eighth, and not on the number of threads.
  void open(std::size_t most) {
    std::vector<std::size_t> made;
    while (!queue_.empty() && group_.parts.size() + kBranching - 1 <= most) {
      const std::size_t capacity = (most - group_.parts.size()) / (kBranching - 1);
      made.clear();
      for (std::size_t left = std::max<std::size_t>(capacity / 8, 1); left != 0 && !queue_.empty(); --left) {
        add_children(queue_.top().second, made);
        queue_.pop();
      }
      group_.boxes.resize(group_.parts.size());
      for_each(made, [&](std::size_t i) { group_.boxes[i] = boxes_.box_of(group_.parts[i]); });
      offer(made);
    }
  }

 private:
  template <class Each> void for_each(const std::vector<std::size_t>& parts, const Each& each) {
    engine_.for_quiet_chunks(
        parts.size(),
        [&](std::size_t, std::size_t begin, std::size_t end) {
          for (std::size_t k = begin; k < end; ++k) each(parts[k]);
        },
        PartBoxes::kChunk);
  }

  void offer(const std::vector<std::size_t>& parts) {
    gains_.resize(group_.parts.size());
    for_each(parts, [&](std::size_t i) { gains_[i] = gain(i); });
    for (const std::size_t i : parts)
      if (gains_[i] > 0.0f) queue_.emplace(gains_[i], i);
  }

  /// Of opening part @p i, as an area; at most 0: none.
  float gain(std::size_t i) const {
    const InstancePart& part = group_.parts[i];
    if (part.ref == kInvalidRef || !is_box(part.ref) || part.depth >= kMostOpenedLevels) return 0.0f;
    double children = 0.0;
    for (const NodeRef child : boxes_.children_of(part))
      if (child != kInvalidRef)
        children += double{format_detail::half_area(boxes_.box_of({part.instance, child, part.depth + 1}))};
    const double area = format_detail::half_area(group_.boxes[i]);
    return static_cast<float>((1.0 + tolerated_excess(double{overlap_[part.instance]})) * area - children);
  }

  /// Replaces a part by its children. The first child gets the parent's index, the others are appended.
  /// @param made receives their indices.
  void add_children(std::size_t opened, std::vector<std::size_t>& made) {
    const InstancePart part = group_.parts[opened];
    bool first = true;
    for (const NodeRef child : boxes_.children_of(part)) {
      if (child == kInvalidRef) continue;
      made.push_back(first ? opened : group_.parts.size());
      if (!first) group_.parts.emplace_back();
      first = false;
      group_.parts[made.back()] = {part.instance, child, part.depth + 1};
    }
  }

  CpuEngine& engine_;
  PartBoxes& boxes_;
  InstanceGroup& group_;
  std::span<const float> overlap_;
  std::vector<float> gains_;
  std::priority_queue<std::pair<float, std::size_t>> queue_;
};

}  // namespace

std::vector<float> measure_overlap(const BufferView& tree, std::size_t count) {
  std::vector<float> overlap(count, 0.0f);
  if (tree.header->root != kInvalidRef)
    dispatch_layout(tree.layout(), [&](auto layout) {
      OverlapMeter<decltype(layout)>(tree).visit(tree.header->root, tree.header->bounds, overlap);
    });
  return overlap;
}

void open_instances(CpuEngine& engine, PartBoxes& boxes, double budget, std::span<const float> overlap) {
  const auto most = static_cast<std::size_t>(budget * static_cast<double>(boxes.group().records.size()));
  Opening(engine, boxes, overlap).open(most);
}

}  // namespace hiprt::build
