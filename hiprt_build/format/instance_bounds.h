#pragma once
/// Bounds of an instance in its scene, from the boxes of its object.

#include <hiprt_build/format/box.h>
#include <hiprt_build/format/motion_bounds.h>
#include <hiprt_build/format/short_stack.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/math/affine.h>

#include <algorithm>
#include <vector>

namespace hiprt::format_detail {

/// Bounds of an instance that may move: transforms boxes of its object to the scene.
class InstanceMotionBounds {
 public:
  /// @param segments none: the instance stands still.
  /// @param slack as that of StillInstanceBounds.
  InstanceMotionBounds(const InstanceRecord& record, std::span<const MotionSegment> segments, MotionKind kind,
                       double slack = 1.0)
      : still_(record, slack), slack_(slack) {
    for (const MotionSegment& segment : segments) motion_.emplace_back(segment, kind);
  }
  /// Instance @p i of a file.
  InstanceMotionBounds(const BufferView& view, std::size_t i, double slack = 1.0)
      : InstanceMotionBounds(view.instances[i], view.motion_of(i),
                             view.motions.empty() ? MotionKind{} : view.motions[i].kind, slack) {}

  /// A box that contains all images of a box of the object, at all times.
  Box bounds(const Box& box) const {
    return motion_.empty() ? still_.bounds(box) : bounds_in_motion(motion_, box, slack_);
  }

 private:
  StillInstanceBounds still_;
  std::vector<SegmentMotion> motion_;
  double slack_;
};

/// The part of an object's file that bounds need.
struct BoundedObject {
  const std::byte* base;
  NodeRef root;
  Box bounds;
  bool has_instances, has_moving_boxes;

  HIPRT_HD BoundedObject(const std::byte* file, const ObjectRecord& record)
      : base(file),
        root(record.root),
        bounds(record.bounds),
        has_instances(record.instances != 0),
        has_moving_boxes((record.features & feature_bit(Feature::kMovingBoxes)) != 0) {}
  // NOLINTNEXTLINE(google-explicit-constructor): the conversion is intended.
  BoundedObject(const BufferView& view)
      : base(view.bytes.data()),
        root(view.header->root),
        bounds(view.header->bounds),
        has_instances(view.has_instances()),
        has_moving_boxes(view.has_moving_boxes()) {}
};

/// A node or run to visit, and the number of levels to go down.
struct PendingPart {
  NodeRef ref;
  unsigned levels;
  float excess;  ///< How far its box reached beyond the result when it was added, relative to the size of the whole.
  Box here;      ///< Its box in the scene.

  HIPRT_HD friend bool operator<(const PendingPart& a, const PendingPart& b) { return a.excess < b.excess; }
};

/// A stack of PendingPart, for bounds from up to @p kLevels levels.
template <unsigned kLevels> using ShortPartStack = ShortStack<PendingPart, 1 + (kBranching - 1) * kLevels>;

/// Grows a box by transformed boxes, from the root of an object down to a level.
/// @tparam Transform InstanceMotionBounds or StillInstanceBounds.
/// @tparam Pending memory for parts: ShortPartStack where there are no vectors.
template <class Layout, class Transform = InstanceMotionBounds, class Pending = std::vector<PendingPart>>
class InstanceBounder {
 public:
  /// Levels: down to the corners of every triangle, and to every custom primitive and instance.
  static constexpr unsigned kToPrimitives = ~0u;

  HIPRT_HD InstanceBounder(const BoundedObject& object, const Transform& to_scene)
      : object_(object), to_scene_(to_scene) {}

  /// @param root the root of the object, or a node or run below it.
  /// @param levels of box nodes to go down. Primitives are visited only with kToPrimitives.
  /// @param box the box to grow: parts inside it are not visited.
  HIPRT_HD Box bounds(NodeRef root, unsigned levels, Box box = empty_box()) {
    result_ = box;
    into_leaves_ = levels == kToPrimitives;
    const Box whole = box_of(root);
    // The box of the whole bounds all parts. Some corner of a part's box may lie outside it.
    limit_ = in_scene(whole);
    if constexpr (kFarthestFirst)
      for (unsigned axis = 0; axis < 3; ++axis) {
        const float size = limit_.max[axis] - limit_.min[axis];
        per_size_[axis] = size > 0.0f ? 1.0f / size : 0.0f;
      }
    pending_.clear();
    if (root != kInvalidRef) offer(root, levels, limit_);
    while (!pending_.empty()) visit(take());
    return result_;
  }

 private:
  /// Vectors are heaps: the part that reaches farthest beyond the result comes first. Most other parts are then inside
  /// the result and are not visited. The result is the same in any order.
  static constexpr bool kFarthestFirst = requires(Pending pending) { pending.begin(); };

  // clang-format off
  HIPRT_MAY_CALL_HOST  // InstanceMotionBounds, which is used on hosts only.
  HIPRT_HD Box in_scene(const Box& box) const { return to_scene_.bounds(box); }
  // clang-format on

  /// The box, in the object, of the object or of a node or run below its root.
  HIPRT_HD Box box_of(NodeRef ref) const {
    if (ref == object_.root || ref == kInvalidRef) return object_.bounds;
    Box box = empty_box();
    if (is_box(ref)) {
      const auto& node = at<typename Layout::Node>(ref);
      for (unsigned c = 0; c < kBranching; ++c)
        if (node.child[c] != kInvalidRef) grow(box, bounded(Layout::box(node, c), object_.bounds));
      return box;
    }
    for_each_leaf(ref, [&](const Box& content) { grow(box, content); });
    return box;
  }

  HIPRT_HD void visit(const PendingPart& part) {
    if (first_plane_outside(part.here, result_) == kNoPlane) return;
    if (part.levels == 0 || (!is_box(part.ref) && !into_leaves_)) {
      grow(result_, part.here);
    } else if (is_box(part.ref)) {
      const auto& node = at<typename Layout::Node>(part.ref);
      for (unsigned c = 0; c < kBranching; ++c)
        if (node.child[c] != kInvalidRef)
          offer(node.child[c], part.levels - 1,
                clipped(in_scene(bounded(Layout::box(node, c), object_.bounds)), limit_));
    } else {
      // The parts of split triangles end at the run's box.
      Box content = empty_box();
      for_each_leaf(part.ref, [&](const Box& box) { grow(content, in_scene(box)); });
      grow(result_, clipped(content, part.here));
    }
  }

  HIPRT_HD void offer(NodeRef ref, unsigned levels, const Box& here) {
    if (first_plane_outside(here, result_) == kNoPlane) return;
    pending_.push_back({ref, levels, kFarthestFirst ? excess_of(here) : 0.0f, here});
    if constexpr (kFarthestFirst) std::push_heap(pending_.begin(), pending_.end());
  }
  HIPRT_HD PendingPart take() {
    if constexpr (kFarthestFirst) {
      // The result only grows. So the excess in the heap is at least the current one.
      for (;;) {
        std::pop_heap(pending_.begin(), pending_.end());
        PendingPart& part = pending_.back();
        const float excess = excess_of(part.here);
        if (pending_.size() == 1 || !(excess < pending_.front().excess)) break;
        part.excess = excess;
        std::push_heap(pending_.begin(), pending_.end());
      }
    }
    const PendingPart part = pending_.back();
    pending_.pop_back();
    return part;
  }
  HIPRT_HD float excess_of(const Box& here) const {
    float most = 0.0f;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const float low = limit_.min[axis], high = limit_.max[axis];
      const float below = (std::min(result_.min[axis], high) - here.min[axis]) * per_size_[axis],
                  above = (here.max[axis] - std::max(result_.max[axis], low)) * per_size_[axis];
      if (below > most) most = below;
      if (above > most) most = above;
    }
    return most;
  }

  /// Calls visit(box) for the corners, or the boxes, of a run's primitives.
  template <class Visit> HIPRT_HD void for_each_leaf(NodeRef ref, const Visit& visit) const {
    for (;; ref += make_ref(kNodeGranularity, NodeType::kTriangle0)) {
      const LeafInfo& info = at<CustomLeaf>(ref).info;
      if (ref_type(ref) == NodeType::kProcedural) {
        // The box of the second primitive, or of a moving instance at the shutter's end.
        visit(at<CustomLeaf>(ref).box[0]);
        if (object_.has_instances ? object_.has_moving_boxes : info.primitive[1] != kInvalidId)
          visit(at<CustomLeaf>(ref).box[1]);
      } else {
        for (unsigned v = 0; v < 4; ++v) {
          Box corner;
          for (unsigned axis = 0; axis < 3; ++axis)
            corner.min[axis] = corner.max[axis] = Layout::coordinate(at<typename Layout::Leaf>(ref), v, axis);
          visit(corner);
        }
      }
      if ((info.geometry_and_flags & kLastInRun) != 0) return;
    }
  }

  HIPRT_HD static Box clipped(Box box, const Box& to) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      if (box.min[axis] < to.min[axis]) box.min[axis] = to.min[axis];
      if (to.max[axis] < box.max[axis]) box.max[axis] = to.max[axis];
    }
    return box;
  }

  template <class Record> HIPRT_HD const Record& at(NodeRef ref) const {
    return *reinterpret_cast<const Record*>(object_.base + ref_offset(ref));
  }

  BoundedObject object_;
  const Transform& to_scene_;
  bool into_leaves_ = false;
  Box limit_{};
  float per_size_[3] = {};  ///< One over the sizes of limit_.
  Box result_{};
  Pending pending_{};
};

/// How much the transforms of a file magnify errors, and the header fields that depend on everything below.
struct InstanceNeeds {
  double condition = 1.0, reach = 0.0;
  std::uint32_t levels = 1, stack = 0;
  FeatureMask features = feature_bit(Feature::kInstances);

  /// Adds an instance that stands still.
  /// @param object not empty.
  HIPRT_HD void add(const InstanceRecord& record, const ObjectRecord& object) {
    const double x = record.translation[0], y = record.translation[1], z = record.translation[2];
    // The Euclidean norm is at most the square root of 3 times norm().
    constexpr double kRoot3 = 1.7320508075688773;
    add(record, object,
        {condition_of(record), 0.0, kRoot3 * LinearInverse(record).norm(), ::sqrt(x * x + y * y + z * z)});
  }
  /// @param by how much its transforms magnify errors.
  HIPRT_HD void add(const InstanceRecord& record, const ObjectRecord& object, const MotionMagnification& by) {
    using affine_detail::larger;
    condition = larger(condition, (by.condition + by.rounding) * (1.0 + static_cast<double>(object.condition)));
    reach = larger(reach, by.farthest + by.longest * static_cast<double>(object.reach));
    if (levels < object.levels + 1) levels = object.levels + 1;
    if (stack < object.stack_bound + kInstanceStackEntries) stack = object.stack_bound + kInstanceStackEntries;
    features |= object.features & ~feature_bit(Feature::kWidenedBoxes);
    if (record.mask != 0xffffffffu) features |= feature_bit(Feature::kMasks);
  }
  HIPRT_HD void add(const InstanceNeeds& other) {
    using affine_detail::larger;
    condition = larger(condition, other.condition);
    reach = larger(reach, other.reach);
    if (levels < other.levels) levels = other.levels;
    if (stack < other.stack) stack = other.stack;
    features |= other.features;
  }
};

/// The record of an object in a scene's file, without its offset.
inline ObjectRecord describe(const BufferView& object) {
  const FileHeader& header = *object.header;
  ObjectRecord record{};
  record.size = object.bytes.size();
  record.geometries = object.geometry_entry.offset;
  record.instances = object.has_instances() ? object.instance_entry.offset : 0;
  record.motions = object.motion_entry.offset;
  record.features = header.features;
  record.bounds = header.bounds;
  record.root = header.root;
  record.condition = header.condition;
  record.reach = header.reach;
  record.stack_bound = header.stack_bound;
  record.levels = header.levels;
  return record;
}

}  // namespace hiprt::format_detail
