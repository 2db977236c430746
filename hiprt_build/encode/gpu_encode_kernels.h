#pragma once
/// Kernels that write nodes and leaves of a file. Internal.

#include <hiprt_build/encode/gpu_write_wide.h>
#include <hiprt_build/encode/widen_boxes.h>
#include <hiprt_build/gpu/build.h>
#include <hiprt_build/refit/refit_file.h>

namespace hiprt::build::kernels {

using gpu::BuildReport;

template <class Layout>
__global__ void __launch_bounds__(kBlock)
    begin_wide_tree(WideWriter<Layout> writer, WideQueue queue, const BuildState* state, GridProgress* progress) {
  if (state->counts.leaves != 0) begin_wide(writer, queue, state->root, thread_index(), *progress);
}
template <class Layout>
__global__ void __launch_bounds__(kBlock)
    write_wide_tree(WideWriter<Layout> writer, WideQueue queue, std::uint32_t many_nodes, BuildState* state,
                    GridProgress* progress) {
  // Trees of 8 or 32 nodes take the same time.
  constexpr unsigned kAlone = 16;
  __shared__ OwnTasks<kAlone> own[kBlock / WaveGroup::kLanes];
  if (state->counts.leaves != 0)
    write_wide(writer, queue, state->root, many_nodes, *progress, state->stack_need,
               own[threadIdx.x / WaveGroup::kLanes]);
}

/// The parents of a file's nodes, and then the nodes' boxes from the leaves up, for layouts that have not got them yet.
template <class Layout>
__global__ void __launch_bounds__(kBlock) link_up(RefitFile<Layout> file, const BuildReport* report) {
  const std::uint32_t i = thread_index();
  if (i < report->nodes && report->view.root != kInvalidRef) LinkUpStep<Layout>{file}(i);
}
template <class Layout>
__global__ void __launch_bounds__(kBlock) encode_nodes(RefitFile<Layout> file, const BuildReport* report) {
  const std::uint32_t i = thread_index();
  if (i < report->nodes && report->view.root != kInvalidRef) RefitNodeStep<Layout>{file}(i);
}
/// The bounds that the root's bytes state.
template <class Layout> __global__ void widen_bounds(RefitFile<Layout> file, BuildReport* report) {
  if (report->nodes == 0 || report->view.root == kInvalidRef) return;
  const Box box = bounded(node_box<Layout>(file.nodes[0]), file.header->bounds);
  file.header->bounds = box;
  report->view.bounds = box;
}

/// BuildOptions::widen_boxes: the margin, the nodes, then the bounds.
static __global__ void widen_header(FileHeader* header, const BuildReport* report) {
  WidenHeaderStep{header, report->nodes}(0);
}
template <class Layout>
__global__ void __launch_bounds__(kBlock) widen_nodes(WidenNodeStep<Layout> step, const BuildReport* report) {
  const std::uint32_t i = thread_index();
  if (i < report->nodes) step(i);
}
template <class Layout> __global__ void widen_view(WidenBoundsStep<Layout> step, BuildReport* report) {
  step(0);
  report->view.bounds = step.header->bounds;
  report->view.features = step.header->features;
  report->view.box_margin = step.header->box_margin;
}

}  // namespace hiprt::build::kernels
