#pragma once
/// Kernels that move the tree over instances. Internal.

#include <hiprt_build/instances/gpu_instance_kernels.h>
#include <hiprt_build/refit/refit_file.h>

namespace hiprt::build::kernels {

/// The tree that a build over instances has made.
template <class Layout> struct UpdatePlan {
  RefitFile<Layout> file;
  BuildReport* built;
  const std::uint32_t* map;  ///< Of instances: kPrimitiveMap.
};

static __global__ void put_boxes(GeometryView view, GeometryView* geometry) { *geometry = view; }

/// Leaves as before finish_instances(), with one primitive each; and instances that have to be in the tree are.
/// @param boxes of the instances.
template <class Layout>
__global__ void __launch_bounds__(kBlock)
    begin_update(UpdatePlan<Layout> plan, const Box* boxes, std::uint32_t instances, SharedNeeds* needs) {
  const std::uint32_t i = thread_index();
  if (i < plan.built->leaves) {
    auto& leaf = reinterpret_cast<CustomLeaf&>(plan.file.leaves[i]);
    leaf.info.primitive[1] = kInvalidId;
    leaf.box[1] = empty_box();
  }
  if (i == 0) *plan.file.outer = OuterPlanes{};
  if (i < instances && plan.map[i] == kInvalidId && boxes[i].min[0] <= boxes[i].max[0])
    needs->add_fault(i, InstanceStatus::kNotInTree);
}

/// A refit's step for each node or leaf of the tree.
template <class Step>
__global__ void __launch_bounds__(kBlock) update_each(Step step, const BuildReport* built, bool leaves) {
  const std::uint32_t i = thread_index();
  if (step.file.header->root != kInvalidRef && i < (leaves ? built->leaves : built->nodes)) step(i);
}

template <class Layout> __global__ void finish_update(UpdatePlan<Layout> plan) {
  if (plan.file.header->root == kInvalidRef) return;
  MoveBoundsStep<Layout>{plan.file}(0);
  plan.built->view.bounds = plan.file.header->bounds;
  bool good = true;
  for (unsigned axis = 0; Layout::kId == NodeLayout::kQuantized && axis < 3; ++axis)
    good = good && plan.file.header->bounds.min[axis] > -kQuantizedLimit &&
           plan.file.header->bounds.max[axis] < kQuantizedLimit;
  plan.built->status = good ? BuildStatus::kOk : BuildStatus::kTooLarge;
}

}  // namespace hiprt::build::kernels
