#include <tools/parts/part_boxes.h>

#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_build/format/instance_bounds.h>
#include <hiprt_device/format/layout.h>

#include <algorithm>
#include <memory>
#include <utility>

namespace hiprt::tools {
namespace {

using format_detail::half_area;
using format_detail::InstanceMotionBounds;

/// Both hold the same, so their common part does.
Box common(Box a, const Box& b) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    a.min[axis] = std::max(a.min[axis], b.min[axis]);
    a.max[axis] = std::min(a.max[axis], b.max[axis]);
  }
  return a;
}

template <class Layout> class BoxOpener {
 public:
  explicit BoxOpener(const BufferView& file) : file_(file) {
    for (const ObjectRecord& object : file.objects) objects_.push_back(*open_buffer(file.object_file(object)));
    subtrees_.push_back({file.header->bounds, file.header->root, &file_, nullptr});
  }

  std::vector<Box> run(std::size_t most) {
    while (!subtrees_.empty()) {
      const auto largest = std::max_element(subtrees_.begin(), subtrees_.end(), [](const Subtree& a, const Subtree& b) {
        return a.closed != b.closed ? a.closed : half_area(a.box) < half_area(b.box);
      });
      if (largest->closed) break;
      const Subtree subtree = *largest;
      std::vector<Subtree> inside = open(subtree);
      if (inside.empty() || subtrees_.size() - 1 + inside.size() > most) {
        largest->closed = true;
        continue;
      }
      subtrees_.erase(largest);
      subtrees_.insert(subtrees_.end(), inside.begin(), inside.end());
    }
    std::vector<Box> boxes;
    for (const Subtree& subtree : subtrees_) boxes.push_back(subtree.box);
    return boxes;
  }

 private:
  /// The instances around a tree, the innermost first.
  struct Placement {
    InstanceMotionBounds to_outer;
    std::shared_ptr<const Placement> outer;
  };
  struct Subtree {
    Box box;  ///< In the scene.
    NodeRef ref;
    const BufferView* file;
    std::shared_ptr<const Placement> placement;
    bool closed = false;  ///< It stays whole.
  };

  static Box in_scene(Box box, const Placement* placement) {
    for (; placement != nullptr; placement = placement->outer.get()) box = placement->to_outer.bounds(box);
    return box;
  }

  /// @return the parts of a subtree; empty: it cannot be opened.
  std::vector<Subtree> open(const Subtree& subtree) const {
    std::vector<Subtree> inside;
    if (is_box(subtree.ref)) {
      const auto& node = at<typename Layout::Node>(*subtree.file, subtree.ref);
      for (unsigned i = 0; i < kBranching; ++i)
        if (node.child[i] != kInvalidRef)
          add(inside, bounded(Layout::box(node, i), subtree.file->header->bounds), node.child[i], subtree);
    } else if (subtree.file->has_instances()) {
      open_instances(subtree, inside);
    }
    return inside;
  }

  void open_instances(const Subtree& subtree, std::vector<Subtree>& inside) const {
    for (NodeRef ref = subtree.ref;; ref += make_ref(kNodeGranularity, NodeType::kTriangle0)) {
      const LeafInfo& info = at<CustomLeaf>(*subtree.file, ref).info;
      const std::uint32_t instance = info.primitive[0];
      const BufferView& object = objects_[subtree.file->instances[instance].object];
      const auto placement = std::make_shared<const Placement>(
          Placement{InstanceMotionBounds(*subtree.file, instance), subtree.placement});
      Subtree entered{subtree.box, entered_ref(info), &object, placement};
      if (is_box(entered.ref)) {
        for (Subtree& part : open(entered)) inside.push_back(std::move(part));
      } else {
        entered.box = common(in_scene(object.header->bounds, placement.get()), subtree.box);
        inside.push_back(std::move(entered));
      }
      if ((info.geometry_and_flags & kLastInRun) != 0) return;
    }
  }

  static void add(std::vector<Subtree>& inside, const Box& box, NodeRef ref, const Subtree& of) {
    inside.push_back({common(in_scene(box, of.placement.get()), of.box), ref, of.file, of.placement});
  }

  template <class Record> static const Record& at(const BufferView& file, NodeRef ref) {
    return *reinterpret_cast<const Record*>(file.bytes.data() + ref_offset(ref));
  }

  BufferView file_;
  std::vector<BufferView> objects_;
  std::vector<Subtree> subtrees_;
};

}  // namespace

std::vector<Box> boxes_near_root(const BufferView& file, std::size_t most) {
  std::vector<Box> boxes;
  if (file.header->root == kInvalidRef) return boxes;
  dispatch_layout(file.layout(), [&](auto layout) { boxes = BoxOpener<decltype(layout)>(file).run(most); });
  return boxes;
}

}  // namespace hiprt::tools
