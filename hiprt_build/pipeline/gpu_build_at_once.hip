#include <hiprt_build/gpu/build.h>
#include <hiprt_build/gpu/import.h>

#include <hiprt_build/pipeline/gpu_build_job.h>

namespace hiprt::gpu {
namespace {

using build::Builder;

Result<Layouts> plan_import(const DeviceGeometry& geometry, const DeviceTree& tree, const BuildOptions& wanted) {
  if (geometry.primitive_count == 0) return plan_build({&geometry, 1}, wanted);
  if (tree.leaf_count == 0 || tree.leaf_count > kMaxBuildPrimitives)
    return fail(ErrorCode::kInvalidInput, "import: a tree of ", tree.leaf_count, " leaves over ",
                geometry.primitive_count, " primitives; it must have 1 to ", kMaxBuildPrimitives);
  if (tree.leaves == nullptr || (tree.nodes == nullptr && tree.leaf_count > 1))
    return fail(ErrorCode::kInvalidInput, "import: nodes and leaves must not be nullptr");
  BuildOptions options = wanted;
  options.builder = Builder::kHploc;
  options.presplit_budget = 1.0;
  options.split_budget.reset();
  if (!options.reinsertion_rounds) options.reinsertion_rounds = 0;
  return plan_build({&geometry, 1}, options, tree.leaf_count);
}

Result<const BuildReport*> enqueue(const Layouts& layouts, std::span<const DeviceGeometry> geometries,
                                   const BuildOptions& options, const DeviceTree& tree, std::byte* output,
                                   std::byte* scratch, hipStream_t stream) {
  const BuildJob job{layouts.plan, options, geometries, layouts.memory(output, scratch), layouts.output(output), tree};
  auto done = enqueue_leaves(job, stream);
  if (done) done = enqueue_split(job, stream);
  if (done) done = enqueue_tree(job, stream);
  if (done) done = enqueue_file(job, stream);
  if (!done) return tl::unexpected(std::move(done.error()));
  return job.output.report;
}

}  // namespace

Result<void> check_memory(const char* function, std::initializer_list<const std::byte*> memory) {
  for (const std::byte* piece : memory)
    if (piece == nullptr || reinterpret_cast<std::uintptr_t>(piece) % kDeviceAlignment != 0)
      return fail(ErrorCode::kInvalidInput, function, ": output and scratch must be aligned to ", kDeviceAlignment,
                  " bytes");
  return {};
}

Result<const BuildReport*> enqueue_build(std::span<const DeviceGeometry> geometries, const BuildOptions& options,
                                         std::byte* output, std::byte* scratch, hipStream_t stream) {
  const auto layouts = plan_build(geometries, options);
  if (!layouts) return tl::unexpected(layouts.error());
  if (auto memory = check_memory("enqueue_build", {output, scratch}); !memory)
    return tl::unexpected(std::move(memory.error()));
  return enqueue(*layouts, geometries, options, DeviceTree{}, output, scratch, stream);
}

Result<BuildSizes> import_sizes(const DeviceGeometry& geometry, const DeviceTree& tree, const BuildOptions& options) {
  const auto layouts = plan_import(geometry, tree, options);
  if (!layouts) return tl::unexpected(layouts.error());
  return layouts->sizes();
}

Result<const BuildReport*> enqueue_import(const DeviceGeometry& geometry, const DeviceTree& tree,
                                          const BuildOptions& options, std::byte* output, std::byte* scratch,
                                          hipStream_t stream) {
  const auto layouts = plan_import(geometry, tree, options);
  if (!layouts) return tl::unexpected(layouts.error());
  if (auto memory = check_memory("enqueue_import", {output, scratch}); !memory)
    return tl::unexpected(std::move(memory.error()));
  return enqueue(*layouts, {&geometry, 1}, options, tree, output, scratch, stream);
}

}  // namespace hiprt::gpu
