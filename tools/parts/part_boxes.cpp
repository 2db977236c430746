#include <tools/parts/part_boxes.h>

#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_device/format/layout.h>

#include <algorithm>

namespace hiprt::tools {
namespace {

struct Subtree {
  Box box;
  NodeRef ref;
};

double area_of(const Box& box) {
  double side[3];
  for (unsigned axis = 0; axis < 3; ++axis)
    side[axis] = static_cast<double>(box.max[axis]) - static_cast<double>(box.min[axis]);
  return side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
}

template <class Layout> std::vector<Box> collect(const BufferView& file, std::size_t most) {
  std::vector<Subtree> subtrees{{file.header->bounds, file.header->root}};
  const auto opens_first = [](const Subtree& a, const Subtree& b) {
    if (is_box(a.ref) != is_box(b.ref)) return is_box(b.ref);
    return area_of(a.box) < area_of(b.box);
  };
  while (true) {
    const auto largest = std::max_element(subtrees.begin(), subtrees.end(), opens_first);
    if (!is_box(largest->ref) || subtrees.size() + kBranching - 1 > most) break;
    const auto& node = *reinterpret_cast<const typename Layout::Node*>(file.bytes.data() + ref_offset(largest->ref));
    subtrees.erase(largest);
    for (unsigned i = 0; i < kBranching; ++i)
      if (node.child[i] != kInvalidRef)
        subtrees.push_back({bounded(Layout::box(node, i), file.header->bounds), node.child[i]});
  }
  std::vector<Box> boxes;
  for (const Subtree& subtree : subtrees) boxes.push_back(subtree.box);
  return boxes;
}

}  // namespace

std::vector<Box> boxes_near_root(const BufferView& file, std::size_t most) {
  std::vector<Box> boxes;
  if (file.header->root == kInvalidRef) return boxes;
  dispatch_layout(file.layout(), [&](auto layout) { boxes = collect<decltype(layout)>(file, most); });
  return boxes;
}

}  // namespace hiprt::tools
