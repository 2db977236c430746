#pragma once
/// Renders many tiles together, step by step, so that a GPU can trace their rays in one batch.

#include <tools/base/parallel.h>
#include <tools/render/studio/render_tile.h>
#include <tools/render/tracers/gpu_tracer.h>

#include <functional>
#include <span>

namespace hiprt::tools {

/// Passes [first, end) of a picture.
struct PassRange {
  unsigned first, end;
};

/// Takes the tiles through the passes, and through finish() after the picture's last one. The CPU traces passes that
/// count work, and batches that are too small for a GPU. The pixels are the same.
/// @param progress called with 0 to 1.
/// @return how many rays went to the GPU; kCancelled when interrupted() became true; the errors of GpuTracer::trace().
build::Result<std::uint64_t> render_together(GpuTracer& gpu, const RenderJob& job, std::span<TileRenderer> tiles,
                                             const PassRange& range, const ThreadLimit& limit,
                                             const std::function<void(double)>& progress);

}  // namespace hiprt::tools
