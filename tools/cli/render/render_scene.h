#pragma once
/// What bvhrender traces, and on what.

#include <tools/cli/render/render_command.h>
#include <tools/cli/trace_device.h>
#include <tools/render/studio/tree_boxes.h>
#include <tools/render/tracers/gpu_tracer.h>

#include <hiprt_build/buffer.h>
#include <hiprt_build/format/view.h>

#include <optional>

namespace hiprt::tools {

/// What is rendered: the scene, or the boxes of its tree as a scene of their own.
struct Subject {
  std::optional<TreeBoxes> boxes;
  build::Buffer buffer;  ///< BVH of the boxes.
  BufferView view;
};

/// @param scene must live as long as the subject. @return the errors of boxes_of_level() and build().
build::Result<Subject> choose_subject(const RenderCommand& command, const BufferView& scene);

/// @return the GPU that traces, or nothing: the CPU traces. The errors of choose_device(); kInvalidInput if the mode
/// needs the CPU; kNoDevice if there are more ranks than GPUs.
build::Result<std::optional<GpuTracer>> choose_tracer(const RenderCommand& command, const BufferView& view,
                                                      const GpuChoice& gpus);

}  // namespace hiprt::tools
