#pragma once
/// bvhtrace in blocks of rays: for files that are larger than memory, and on several ranks.

#include <tools/cli/ranks/run_options.h>
#include <tools/cli/trace/block_journal.h>
#include <tools/distributed/ranks.h>
#include <tools/render/tracers/gpu_tracer.h>
#include <tools/scene_io/ray_stream.h>

#include <hiprt_build/format/view.h>

#include <functional>
#include <optional>
#include <string>

namespace hiprt::tools {

/// What every rank needs to trace a block.
struct BulkScene {
  const SceneView& scene;
  const RayStream& rays;
  Query query;
  TracePolicies policies;
  float time;
  std::uint64_t block;  ///< Rays per block, at least 1.
  bool paths;           ///< Whether the result has the instance paths.
  std::optional<GpuTracer>& gpu;
  unsigned threads;

  std::uint64_t blocks() const { return (rays.count() + block - 1) / block; }
};

/// What rank 0 writes, and how long it keeps.
struct BulkOutput {
  std::string hits, paths;  ///< `paths` may be empty.
  ResumeOptions resume;
  PictureKey key;  ///< What the results depend on.
  bool lossy = false;
  std::function<void(double)> progress{};
  std::function<void(const std::string&)> warn{};
};

struct BulkResult {
  std::uint64_t hits = 0;
  double seconds = 0.0;  ///< Of all runs, with reading and writing.
};

/// Traces all blocks that are not done and writes the files, in the order of the rays. Every rank makes this call.
/// @param scene on ranks other than 0 possibly an error: then the run ends with it.
/// @return the result on rank 0; kCancelled, also if a checkpoint keeps the work; kBackend for lost ranks.
build::Result<BulkResult> trace_in_blocks(Ranks& ranks, const build::Result<BulkScene>& scene,
                                          const BulkOutput& output);

}  // namespace hiprt::tools
