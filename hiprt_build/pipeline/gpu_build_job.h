#pragma once
/// The parts of a build on the device. Internal.

#include <hiprt_build/gpu/import.h>
#include <hiprt_build/pipeline/gpu_build_plan.h>

#include <span>

namespace hiprt::gpu {

struct BuildJob {
  const BuildPlan& plan;
  const BuildOptions& options;
  std::span<const DeviceGeometry> geometries;
  BuildMemory memory;
  BuildOutput output;
  DeviceTree imported{};  ///< Of a plan that imports.
};

/// Leaves of one or two primitives. Uses the head, references, pairing and records.
Result<void> enqueue_leaves(const BuildJob& job, hipStream_t stream);
/// References that are split in parts, and what the top-down builders make of them: the gapped tree if there is one,
/// else the tree. Uses the head, references, these and the scratch.
Result<void> enqueue_split(const BuildJob& job, hipStream_t stream);
/// Uses the head, the tree and its scratch; references or the gapped tree; for an imported tree also the records.
Result<void> enqueue_tree(const BuildJob& job, hipStream_t stream);
/// The file and its report. Uses the head and the tree.
Result<void> enqueue_file(const BuildJob& job, hipStream_t stream);

/// What the scene of a report cannot be used for: as compact() returns it.
Result<void> check_report(const BuildReport& report);

/// Zero bytes between the sections of a file on the device.
Result<void> clear_gaps(std::byte* base, const FileLayout& file, NodeLayout layout, hipStream_t stream);

/// With the device's functions.
Result<void> check_memory(const char* function, std::initializer_list<const std::byte*> memory);

}  // namespace hiprt::gpu
