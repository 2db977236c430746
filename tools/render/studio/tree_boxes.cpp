#include <tools/render/studio/tree_boxes.h>

#include <hiprt_build/format/view.h>
#include <hiprt_device/format/layout.h>
#include <hiprt_device/instances/motion.h>
#include <hiprt_device/math/affine.h>
#include <tools/scene_io/transform.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>

namespace hiprt::tools {
namespace {

/// From the space of an instance's object to that of its scene.
Transform to_scene_of(const InstanceRecord& instance) {
  const LinearInverse inverse(instance);
  Transform result;
  for (unsigned r = 0; r < 3; ++r) {
    std::copy_n(inverse.row[r], 3, result.m[r].begin());
    result.m[r][3] = double{instance.translation[r]};
  }
  return result;
}

/// Corners of the two sides across each axis, as TreeBoxes::triangles wants them.
std::array<build::Triangle, TreeBoxes::kTriangles> sides() {
  std::array<build::Triangle, TreeBoxes::kTriangles> result;
  std::size_t next = 0;
  for (unsigned axis = 0; axis < 3; ++axis)
    for (unsigned end = 0; end < 2; ++end) {
      const unsigned a = 1u << (axis + 1) % 3, b = 1u << (axis + 2) % 3, first = end << axis;
      result[next++] = {first, first | a, first | b};
      result[next++] = {first | a | b, first | b, first | a};
    }
  return result;
}

/// Walks from box to box, the last found first.
template <class Layout> class BoxWalk {
 public:
  BoxWalk(const BufferView& file, float time) : file_(file), time_(time) {
    for (const ObjectRecord& object : file.objects) objects_.push_back(*open_buffer(file.object_file(object)));
  }

  /// @return whether there was room.
  bool run(unsigned level) {
    if (file_.header->root == kInvalidRef) return true;
    pending_.push_back({&file_, file_.header->root, file_.header->bounds, {}, level});
    while (!pending_.empty()) {
      const Part part = pending_.back();
      pending_.pop_back();
      if (part.levels == 0)
        add(part);
      else if (is_box(part.ref))
        open(part);
      else
        open_leaf(part);
      if (pending_.size() + result_.count() > kMostTreeBoxes) return false;
    }
    return true;
  }

  TreeBoxes take() { return std::move(result_); }

 private:
  struct Part {
    const BufferView* file;
    NodeRef ref;
    Box box;
    Transform to_scene;  ///< From the space of the file.
    unsigned levels;     ///< To go.
  };

  void open(const Part& part) {
    const auto& node = *reinterpret_cast<const typename Layout::Node*>(part.file->bytes.data() + ref_offset(part.ref));
    for (unsigned i = 0; i < kBranching; ++i)
      if (node.child[i] != kInvalidRef)
        pending_.push_back({part.file, node.child[i], bounded(Layout::box(node, i), part.file->header->bounds),
                            part.to_scene, part.levels - 1});
  }

  void open_leaf(const Part& part) {
    const BufferView& file = *part.file;
    const LeafInfo& info = reinterpret_cast<const CustomLeaf*>(file.bytes.data() + ref_offset(part.ref))->info;
    if (!file.has_instances() || !is_box(entered_ref(info))) return add(part);
    const std::uint32_t instance = info.primitive[0];
    InstanceRecord record = file.instances[instance];
    if (!file.motions.empty()) record = at_time(record, file.motions[instance], file.bytes.data(), time_);
    open({&objects_[record.object], entered_ref(info), {}, part.to_scene * to_scene_of(record), part.levels});
  }

  void add(const Part& part) {
    const auto first = static_cast<std::uint32_t>(result_.corners.size());
    for (unsigned i = 0; i < TreeBoxes::kCorners; ++i) {
      build::Position corner{};
      for (unsigned axis = 0; axis < 3; ++axis)
        corner[axis] = (i >> axis & 1u) != 0 ? part.box.max[axis] : part.box.min[axis];
      result_.corners.push_back(part.to_scene(corner));
    }
    for (const build::Triangle& side : sides_)
      result_.triangles.push_back({first + side[0], first + side[1], first + side[2]});
  }

  const BufferView& file_;
  float time_;
  std::vector<BufferView> objects_;
  std::vector<Part> pending_;
  TreeBoxes result_;
  const std::array<build::Triangle, TreeBoxes::kTriangles> sides_ = sides();
};

}  // namespace

build::Result<TreeBoxes> boxes_of_level(const BufferView& file, unsigned level, float time) {
  std::optional<TreeBoxes> boxes;
  dispatch_layout(file.layout(), [&](auto layout) {
    BoxWalk<decltype(layout)> walk(file, time);
    if (walk.run(level)) boxes = walk.take();
  });
  if (!boxes)
    return tl::unexpected(
        build::Error{build::ErrorCode::kTooLarge, "level " + std::to_string(level) + " of the tree has more than " +
                                                      std::to_string(kMostTreeBoxes) + " boxes: use a lower --level"});
  if (boxes->count() == 0)
    return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput, "the tree is empty: it has no boxes"});
  return std::move(*boxes);
}

}  // namespace hiprt::tools
