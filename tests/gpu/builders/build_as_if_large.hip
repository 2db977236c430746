#include <tests/gpu/builders/build_as_if_large.h>

#include <hiprt_build/pipeline/gpu_build_job.h>

namespace hiprt::checks {

gpu::Result<const gpu::BuildReport*> enqueue_as_if_large(std::span<const gpu::DeviceGeometry> geometries,
                                                         const gpu::BuildOptions& options, std::byte* output,
                                                         std::byte* scratch) {
  auto layouts = gpu::plan_build(geometries, options);
  if (!layouts) return tl::unexpected(layouts.error());
  layouts->plan.many_nodes = 0;
  layouts->plan.unasked = 1;
  const gpu::BuildJob job{layouts->plan, options, geometries, layouts->memory(output, scratch),
                          layouts->output(output)};
  auto done = gpu::enqueue_leaves(job, nullptr);
  if (done) done = gpu::enqueue_split(job, nullptr);
  if (done) done = gpu::enqueue_tree(job, nullptr);
  if (done) done = gpu::enqueue_file(job, nullptr);
  if (!done) return tl::unexpected(done.error());
  return job.output.report;
}

}  // namespace hiprt::checks
