#pragma once
/// Kernels that give encoded nodes new boxes, and measure trees. Internal.

#include <hiprt_build/gpu/refit.h>
#include <hiprt_build/refit/refit_file.h>
#include <hiprt_build/statistics/tree_quality_steps.h>

namespace hiprt::build::kernels {

inline constexpr unsigned kRefitBlock = 256;
/// Blocks of measure_nodes(): the sums do not depend on the device.
inline constexpr unsigned kQualityBlocks = 512;

/// Arguments of put_moved().
struct MovedChunk {
  static constexpr unsigned kSize = 64;
  GeometryView geometries[kSize];
};

static __global__ void start_refit(gpu::RefitReport* report, OuterPlanes* outer, std::uint64_t* fault) {
  *report = gpu::RefitReport{};
  *outer = OuterPlanes{};
  *fault = 0;
}

/// The first fault counts: the lowest kind, of those the lowest number.
HIPRT_HD inline std::uint64_t fault_key(gpu::RefitStatus status, std::uint32_t place) {
  return ~(static_cast<std::uint64_t>(status) << 32 | place);
}

static __global__ void put_moved(MovedChunk chunk, std::uint32_t begin, std::uint32_t count,
                                 const GeometryRecord* records, GeometryView* geometries, std::uint64_t* fault) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  geometries[begin + i] = chunk.geometries[i];
  const GeometryRecord record = records[begin + i];
  const bool custom = (record.flags & kGeometryCustom) != 0;
  const GeometryView& moved = chunk.geometries[i];
  if (record.primitive_count != moved.primitive_count || (moved.primitive_count != 0 && custom != moved.is_custom()))
    raise(fault, fault_key(gpu::RefitStatus::kOtherScene, begin + i));
}

HIPRT_HD inline gpu::RefitStatus to_status(MoveFault fault) {
  switch (fault) {
    case MoveFault::kNone:
      return gpu::RefitStatus::kOk;
    case MoveFault::kNotFinite:
      return gpu::RefitStatus::kNotFinite;
    case MoveFault::kInverted:
      return gpu::RefitStatus::kInverted;
    case MoveFault::kTooLarge:
      return gpu::RefitStatus::kTooLarge;
    case MoveFault::kComeApart:
      return gpu::RefitStatus::kComeApart;
  }
  return gpu::RefitStatus::kOk;
}

/// Whether the indices of a leaf's triangles can be followed.
HIPRT_HD inline bool has_good_indices(const GeometryView& mesh, const LeafInfo& info) {
  for (unsigned t = 0; t < 2; ++t)
    for (unsigned k = 0; k < 3 && info.primitive[t] != kInvalidId; ++k)
      if (mesh.triangle(info.primitive[t])[k] >= mesh.position_count) return false;
  return true;
}

template <class Layout>
__global__ void __launch_bounds__(kRefitBlock)
    check_leaves(RefitFile<Layout> file, std::uint32_t leaves, float limit, std::uint64_t* fault) {
  const std::uint32_t i = blockIdx.x * kRefitBlock + threadIdx.x;
  // Other scenes have arrays of other sizes.
  if (i >= leaves || *fault >= fault_key(gpu::RefitStatus::kOtherScene, kInvalidId)) return;
  const LeafInfo info = file.leaves[i].info;
  const std::uint32_t g = info.geometry_and_flags & kGeometryMask;
  gpu::RefitStatus status = gpu::RefitStatus::kOk;
  if (!file.geometries[g].is_custom() && !has_good_indices(file.geometries[g], info))
    status = gpu::RefitStatus::kBadIndex;
  else
    status = to_status(leaf_fault(file.geometries, info, limit));
  if (status != gpu::RefitStatus::kOk) raise(fault, fault_key(status, i));
}

/// Step i of n unless the refit has failed.
template <class Step>
__global__ void __launch_bounds__(kRefitBlock) refit_each(Step step, std::uint32_t count, const std::uint64_t* fault) {
  const std::uint32_t i = blockIdx.x * kRefitBlock + threadIdx.x;
  if (i < count && *fault == 0) step(i);
}

/// Part b of the sums: every kQualityBlocks-th run of nodes, added up in one order.
template <class Layout>
__global__ void __launch_bounds__(kRefitBlock)
    measure_nodes(TreeQuality<Layout> quality, std::uint32_t nodes, QualitySums* parts) {
  // Plain bytes: shared memory has no constructors.
  alignas(QualitySums) __shared__ unsigned char memory[kRefitBlock * sizeof(QualitySums)];
  auto* shared = reinterpret_cast<QualitySums*>(memory);
  QualitySums sums;
  for (std::uint32_t i = blockIdx.x * kRefitBlock + threadIdx.x; i < nodes; i += kQualityBlocks * kRefitBlock)
    sums.add(quality(i));
  shared[threadIdx.x] = sums;
  __syncthreads();
  for (unsigned half = kRefitBlock / 2; half > 0; half /= 2) {
    if (threadIdx.x < half) shared[threadIdx.x].add(shared[threadIdx.x + half]);
    __syncthreads();
  }
  if (threadIdx.x == 0) parts[blockIdx.x] = shared[0];
}

template <class Layout>
__global__ void finish_refit(TreeQuality<Layout> quality, const QualitySums* parts, const std::uint64_t* fault,
                             const GeometryRecord* geometries, gpu::RefitReport* report) {
  QualitySums sums;
  for (unsigned i = 0; i < kQualityBlocks; ++i) sums.add(parts[i]);
  const FileHeader& header = *quality.header;
  report->view = SceneView{reinterpret_cast<const std::byte*>(quality.header),
                           header.byte_size,
                           geometries,
                           header.root,
                           header.stack_bound,
                           header.features,
                           Layout::kId,
                           header.bounds};
  report->view.box_margin = header.box_margin;
  report->sah_cost = quality.sah_cost(sums);
  report->exchange_slack = sums.exchange_slack();
  if (*fault == 0) return;
  report->status = static_cast<gpu::RefitStatus>(~*fault >> 32);
  report->leaf = static_cast<std::uint32_t>(~*fault);
}

}  // namespace hiprt::build::kernels
