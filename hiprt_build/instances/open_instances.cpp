#include <hiprt_build/format/view.h>
#include <hiprt_build/instances/open_instances.h>

#include <algorithm>
#include <queue>

namespace hiprt::build {
namespace {

/// Which parts to open next, the largest first.
class Opening {
 public:
  Opening(CpuEngine& engine, PartBoxes& boxes, bool largest)
      : engine_(engine), boxes_(boxes), group_(boxes.group()), largest_(largest) {
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
    areas_.resize(group_.parts.size());
    for_each(parts, [&](std::size_t i) { areas_[i] = area_to_open(i); });
    for (const std::size_t i : parts)
      if (areas_[i] > 0.0f) queue_.emplace(areas_[i], i);
  }

  /// The area of part @p i's box if it may be opened and gains by it; else 0.
  float area_to_open(std::size_t i) const {
    const InstancePart& part = group_.parts[i];
    if (part.ref == kInvalidRef || !is_box(part.ref) || part.depth >= kMostOpenedLevels) return 0.0f;
    const float area = format_detail::half_area(group_.boxes[i]);
    if (largest_) return area;
    double children = 0.0;
    for (const NodeRef child : boxes_.children_of(part))
      if (child != kInvalidRef)
        children += double{format_detail::half_area(boxes_.box_of({part.instance, child, part.depth + 1}))};
    return children < double{area} ? area : 0.0f;
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
  bool largest_;
  std::vector<float> areas_;
  std::priority_queue<std::pair<float, std::size_t>> queue_;
};

}  // namespace

void open_instances(CpuEngine& engine, PartBoxes& boxes, double budget, bool largest) {
  const auto most = static_cast<std::size_t>(budget * static_cast<double>(boxes.group().records.size()));
  Opening(engine, boxes, largest).open(most);
}

}  // namespace hiprt::build
