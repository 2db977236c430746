#pragma once
/// Kernels of builds over instances: what comes before the tree and behind it. Internal.

#include <hiprt_build/gpu/instances.h>
#include <hiprt_build/input/geometry.h>
#include <hiprt_build/instances/gpu_motion.h>
#include <hiprt_build/instances/make_instance.h>
#include <hiprt_build/pipeline/gpu_state.h>

#include <bit>

namespace hiprt::build::kernels {

using gpu::BuildReport;
using gpu::BuildStatus;
using gpu::DeviceInstance;
using gpu::InstanceReport;
using gpu::InstanceStatus;

/// format_detail::InstanceNeeds that many threads raise, and the first fault.
struct SharedNeeds {
  std::uint64_t condition, reach;  ///< The bits of doubles, which are not negative.
  std::uint32_t levels, stack;
  std::uint32_t features;
  std::uint32_t fault;  ///< kStatuses * instance + status of the first; kInvalidId: none.

  /// More than there are InstanceStatus. Instances are below 2^28.
  static constexpr std::uint32_t kStatuses = 16;
  HIPRT_HD void add_fault(std::uint32_t instance, InstanceStatus status) {
    if (status != InstanceStatus::kOk) hiprt::lower(&fault, kStatuses * instance + static_cast<std::uint32_t>(status));
  }

  HIPRT_HD void clear() {
    const format_detail::InstanceNeeds none;
    condition = std::bit_cast<std::uint64_t>(none.condition);
    reach = std::bit_cast<std::uint64_t>(none.reach);
    levels = none.levels;
    stack = none.stack;
    features = static_cast<std::uint32_t>(none.features);
    fault = kInvalidId;
  }
  HIPRT_HD void add(const format_detail::InstanceNeeds& needs) {
    raise(&condition, std::bit_cast<std::uint64_t>(needs.condition));
    raise(&reach, std::bit_cast<std::uint64_t>(needs.reach));
    raise(&levels, needs.levels);
    raise(&stack, needs.stack);
    set_bits(&features, static_cast<std::uint32_t>(needs.features));
  }
  HIPRT_HD void add(const SharedNeeds& other) {
    raise(&condition, other.condition);
    raise(&reach, other.reach);
    raise(&levels, other.levels);
    raise(&stack, other.stack);
    set_bits(&features, other.features);
    hiprt::lower(&fault, other.fault);
  }
};

/// Step: the record and the box of instance i.
template <class Layout> struct MakeInstanceStep {
  const DeviceInstance* instances;
  std::uint32_t count;
  const gpu::KeyRange* ranges;  ///< nullptr: nothing moves.
  gpu::SceneObjects objects;
  unsigned levels;  ///< Of the objects' nodes that boxes are made of.
  InstanceRecord* records;
  Box* boxes;  ///< The empty box for instances that are not to be in the tree.

  /// @param needs grows.
  HIPRT_HD InstanceStatus operator()(std::uint32_t i, format_detail::InstanceNeeds& needs) const {
    boxes[i] = format_detail::empty_box();
    records[i] = InstanceRecord{};
    const DeviceInstance instance = instances[i];
    if (instance.object >= objects.count) return InstanceStatus::kBadObject;
    if ((instance.flags & ~InstanceFlags::kKnown) != 0) return InstanceStatus::kBadFlags;
    const ObjectRecord& object = objects.records[instance.object];
    if (const InstanceStatus fault = fault_of(object); fault != InstanceStatus::kOk) return fault;
    // MoveInstanceStep makes the moving ones.
    if (ranges != nullptr && ranges[i].count != 0) return InstanceStatus::kOk;
    MadeInstance made = make_instance(instance.to_scene.row);
    if (made.fault != TransformFault::kNone) return static_cast<InstanceStatus>(made.fault);
    set_numbers(made.record, instance);
    records[i] = made.record;
    if (object.root == kInvalidRef) return InstanceStatus::kOk;
    needs.add(made.record, object);
    const Box box = instance_box<Layout>(made.record, object, objects.base + object.offset, levels);
    if (format_detail::first_bad_plane(box) != format_detail::kNoPlane) return InstanceStatus::kTooFar;
    boxes[i] = box;
    return InstanceStatus::kOk;
  }

  HIPRT_HD static void set_numbers(InstanceRecord& record, const DeviceInstance& instance) {
    record.object = instance.object;
    record.mask = instance.mask;
    record.id = instance.id;
    record.flags = instance.flags;
  }

 private:
  /// Records of enqueue_objects() have the object's layout where files have 0.
  HIPRT_HD InstanceStatus fault_of(const ObjectRecord& object) const {
    if (object.root == kInvalidRef) return InstanceStatus::kOk;
    if (object.reserved != 0 && object.reserved != static_cast<std::uint32_t>(objects.layout))
      return InstanceStatus::kOtherLayout;
    const bool moving_boxes = (object.features & feature_bit(Feature::kMovingBoxes)) != 0;
    return moving_boxes && objects.shutter_rate == 0.0f ? InstanceStatus::kOtherShutter : InstanceStatus::kOk;
  }
};

static __global__ void start_instances(SharedNeeds* needs) { needs->clear(); }

/// Few threads each: all processors get some of ten thousand, which take long one by one.
inline constexpr unsigned kInstanceBlock = 64;

template <class Layout>
__global__ void __launch_bounds__(kInstanceBlock) make_instances(MakeInstanceStep<Layout> step, SharedNeeds* needs) {
  __shared__ SharedNeeds together;
  if (threadIdx.x == 0) together.clear();
  __syncthreads();
  const std::uint32_t i = thread_index();
  if (i < step.count) {
    format_detail::InstanceNeeds mine;
    const InstanceStatus status = step(i, mine);
    together.add(mine);
    together.add_fault(i, status);
  }
  __syncthreads();
  if (threadIdx.x == 0) needs->add(together);
}

/// Where everything is that finish_instances() makes whole.
struct InstancePlan {
  std::byte* output;
  const BuildReport* built;
  gpu::DeviceInstances from;
  gpu::SceneObjects objects;
  CustomLeaf* leaves;
  InstanceRecord* records;
  MotionRecord* motions;      ///< nullptr: nothing moves.
  ObjectRecord* own_objects;  ///< With offsets that count from the output.
  InstanceReport* report;
  std::uint64_t size;  ///< Bytes of the output.
};

/// What the tree's build and the instances say, in this order.
HIPRT_HD inline void judge(const InstancePlan& plan, const SharedNeeds& needs, InstanceReport& report) {
  if (needs.fault != kInvalidId) {
    report.status = static_cast<InstanceStatus>(needs.fault % SharedNeeds::kStatuses);
    report.instance = needs.fault / SharedNeeds::kStatuses;
    const DeviceInstance& instance = plan.from.instances[report.instance];
    report.object = instance.object;
    const bool moves = plan.motions != nullptr && plan.from.motions.ranges[report.instance].count != 0;
    const bool of_keys = moves && report.object < plan.objects.count;
    const Affine to_scene = of_keys ? judge_motion(plan.from.motions, report) : instance.to_scene;
    if (report.status != InstanceStatus::kNoInverse) return;
    const MadeInstance made = make_instance(to_scene.row);
    report.determinant = made.determinant;
    report.condition = made.condition;
    return;
  }
  const auto condition = std::bit_cast<double>(needs.condition), reach = std::bit_cast<double>(needs.reach);
  constexpr double kMostReach = 0x1.fffffep127;
  if (!(condition <= static_cast<double>(kMaxCondition) && reach <= kMostReach)) {
    report.status = InstanceStatus::kIllConditioned;
    report.condition = condition;
  } else if (plan.built->status == BuildStatus::kTooDeep) {
    report.status = InstanceStatus::kTooDeep;
  } else if (plan.built->status == BuildStatus::kTooLarge) {
    report.status = InstanceStatus::kTooLarge;
  }
}

/// As build_instances() does, whether or not an instance is of what moves.
HIPRT_HD inline bool has_moving_boxes(const gpu::SceneObjects& objects) { return objects.shutter_rate != 0.0f; }

HIPRT_HD inline InstanceReport instance_report(const InstancePlan& plan, const SharedNeeds& needs) {
  InstanceReport report;
  judge(plan, needs, report);
  report.instances = plan.from.count;
  report.nodes = plan.built->nodes;
  report.leaves = plan.built->leaves;
  SceneView& view = report.view;
  view = plan.built->view;
  view.size = plan.size;
  view.instances = plan.records;
  view.motions = plan.motions;
  view.objects = plan.own_objects;
  view.features = needs.features;
  view.levels = needs.levels;
  view.stack_bound += needs.stack;
  view.condition = affine_detail::round_up(std::bit_cast<double>(needs.condition));
  view.reach = affine_detail::round_up(std::bit_cast<double>(needs.reach));
  if (has_moving_boxes(plan.objects)) {
    view.features |= feature_bit(Feature::kMovingBoxes);
    view.shutter_begin = plan.objects.shutter_begin;
    view.shutter_rate = plan.objects.shutter_rate;
  }
  if (report.status != InstanceStatus::kOk) view.root = kInvalidRef;
  return report;
}

/// Leaves name where rays enter, objects count from here, and thread 0 sums up.
static __global__ void __launch_bounds__(kBlock) finish_instances(InstancePlan plan, const SharedNeeds* needs) {
  const std::uint32_t i = thread_index();
  if (i < plan.built->leaves) {
    LeafInfo& info = plan.leaves[i].info;
    // What moves does so within the objects.
    if (has_moving_boxes(plan.objects)) plan.leaves[i].box[1] = plan.leaves[i].box[0];
    info.primitive[1] = plan.objects.records[plan.records[info.primitive[0]].object].root;
  }
  if (i < plan.objects.count) {
    ObjectRecord object = plan.objects.records[i];
    // Modulo 2^64: separate objects may lie before the output.
    object.offset += reinterpret_cast<std::uintptr_t>(plan.objects.base);
    object.offset -= reinterpret_cast<std::uintptr_t>(plan.output);
    object.reserved = 0;
    plan.own_objects[i] = object;
  }
  if (i == 0) *plan.report = instance_report(plan, *needs);
}

}  // namespace hiprt::build::kernels
