#pragma once
/// Small BVHs, each made by one block whose shared memory holds everything but the result. Internal.

#include <hiprt_build/encode/gpu_write_wide.h>
#include <hiprt_build/gpu/batch.h>
#include <hiprt_build/lbvh_ploc/hploc.h>
#include <hiprt_build/lbvh_ploc/lbvh.h>
#include <hiprt_build/lbvh_ploc/morton.h>
#include <hiprt_build/pair/pair_window.h>
#include <hiprt_build/pipeline/gpu_geometry.h>
#include <hiprt_build/pipeline/gpu_state.h>

namespace hiprt::build::kernels {

/// What all blocks read and write.
struct BatchJob {
  GeometryView together;                  ///< The arrays that all meshes share.
  const gpu::DeviceGeometry* geometries;  ///< Or arrays of their own; else nullptr.
  const std::uint32_t* first;             ///< Primitive of each mesh; one more at the end.
  bool pair, hploc;
  std::uint32_t radius;
  CollapseCosts costs;
  std::byte* base;
  std::uint64_t nodes_offset, leaves_offset;  ///< Mesh i has the records from its first triangle on.
  GeometryRecord* records;                    ///< Per mesh; one for all if the arrays are shared.
  SceneView* views;
  gpu::BatchCounts* counts;
  gpu::BatchReport* report;
  std::uint64_t size;  ///< Bytes behind base.

  HIPRT_HD GeometryView geometry(std::uint32_t mesh) const {
    if (geometries != nullptr) {
      GeometryView view = gpu::view_of(geometries[mesh]);
      view.given_pairs = false;
      return view;
    }
    GeometryView view = together;
    view.triangles += std::uint64_t{first[mesh]} * sizeof(Triangle);
    view.primitive_count = first[mesh + 1] - first[mesh];
    return view;
  }
  HIPRT_HD GeometryRecord* record(std::uint32_t mesh) const { return geometries != nullptr ? records + mesh : records; }
};

/// @tparam kMost triangles of a mesh.
template <unsigned kMost, unsigned kThreads> struct BatchMemory {
  static constexpr unsigned kGroups = kThreads / WaveGroup::kLanes;
  using Pairs = PairWindow<WaveGroup>;
  using Climber = Hploc<WaveGroup, PlannedTree>;

  BuildState state;
  WideProgress<8> progress;
  GeometryView geometry;
  Reference sorted[kMost];
  union {
    Reference references[kMost];  ///< In the order of the triangles.
    LinkedNode nodes[kMost];
  };
  union {
    std::uint64_t keys[kMost];
    CollapsePlan plans[kMost];
  };
  LeafPrimitives primitives[kMost];
  std::uint32_t met[kMost];
  KeptCluster kept[kMost];
  std::uint8_t levels[kMost];
  union {
    typename Pairs::Shared pairs[kGroups];
    typename Climber::Shared clusters[kGroups];
  };
};

template <unsigned kMost, unsigned kThreads> class BatchBlock {
 public:
  using Memory = BatchMemory<kMost, kThreads>;

  __device__ BatchBlock(const BatchJob& job, Memory& memory, std::uint32_t mesh)
      : job_(job), m_(memory), mesh_(mesh), first_(job.first[mesh]), count_(job.first[mesh + 1] - first_) {}

  __device__ void run() {
    if (threadIdx.x == 0) {
      m_.geometry = job_.geometry(mesh_);
      m_.state.bounds.clear();
      m_.state.centers.clear();
      m_.state.counts = GroupCounts{};
      m_.state.root = kInvalidId;
      m_.state.stack_need = 0;
    }
    __syncthreads();
    pair();
    __syncthreads();
    sort();
    __syncthreads();
    if (m_.state.counts.leaves != 0) {
      climb(job_.hploc);
      __syncthreads();
      const bool again = is_too_deep();
      __syncthreads();
      if (again) climb_again();
    }
    __syncthreads();
    if (m_.state.counts.leaves != 0) write();
    __syncthreads();
    if (threadIdx.x == 0) finish();
  }

 private:
  __device__ GeometryTable geometries() const { return {&m_.geometry, 1, count_}; }

  __device__ void pair() {
    const typename Memory::Pairs windows{geometries(), job_.pair};
    const unsigned my_group = threadIdx.x / WaveGroup::kLanes;
    for (std::uint32_t w = my_group; w * kPairWindow < count_; w += Memory::kGroups)
      windows(WaveGroup{}, m_.pairs[my_group], w, [&](const PairedPrimitive& paired) {
        m_.references[paired.primitive] = Reference{paired.box, paired.contents, paired.primitive};
        if (paired.dropped != kKept) fetch_add(&m_.state.counts.dropped[paired.dropped], 1);
        if (!paired.contents.exists()) return;
        fetch_add(&m_.state.counts.leaves, 1);
        m_.state.bounds.add(paired.box);
        Box center;
        for (unsigned axis = 0; axis < 3; ++axis)
          center.min[axis] = center.max[axis] = split_position(paired.box, axis);
        m_.state.centers.add(center);
      });
  }

  /// By counting the keys before each.
  __device__ void sort() {
    const MortonGrid grid = MortonGrid::over(m_.state.centers.get(), kMortonBits63);
    for (std::uint32_t i = threadIdx.x; i < count_; i += kThreads)
      m_.keys[i] = m_.references[i].contents.exists() ? grid.code(m_.references[i].box) : ~std::uint64_t{0};
    __syncthreads();
    for (std::uint32_t i = threadIdx.x; i < count_; i += kThreads) {
      if (!m_.references[i].contents.exists()) continue;
      const std::uint64_t key = m_.keys[i];
      std::uint32_t to = 0;
      for (std::uint32_t j = 0; j < count_; ++j) to += m_.keys[j] < key || (m_.keys[j] == key && j < i) ? 1 : 0;
      m_.sorted[to] = m_.references[i];
      m_.primitives[to] = LeafPrimitives{m_.references[i].primitive, m_.references[i].contents};
      m_.met[to] = kInvalidId;
    }
    __syncthreads();
    for (std::uint32_t i = threadIdx.x; i + 1 < m_.state.counts.leaves; i += kThreads)
      m_.levels[i] = boundary_level(grid.code(m_.sorted[i].box), grid.code(m_.sorted[i + 1].box), i);
  }

  __device__ void climb(bool hploc) {
    const std::uint32_t leaves = m_.state.counts.leaves;
    const PlannedTree tree{{m_.sorted}, m_.nodes, {m_.plans, m_.sorted, job_.costs}, &m_.state.root};
    if (!hploc) {
      for (std::uint32_t i = threadIdx.x; i < leaves; i += kThreads)
        LbvhStep<PlannedTree>{tree, leaves, m_.levels, m_.met}(i);
      return;
    }
    const typename Memory::Climber climber{tree, leaves, m_.levels, m_.met, m_.kept, job_.radius};
    const unsigned my_group = threadIdx.x / WaveGroup::kLanes;
    for (std::uint32_t i = my_group * WaveGroup::kLanes; i < leaves; i += kThreads)
      climber(WaveGroup{}, m_.clusters[my_group], i + threadIdx.x % WaveGroup::kLanes);
  }

  /// As check_depth().
  __device__ bool is_too_deep() const {
    const LinkedRef root = m_.state.root;
    return (root & kLinkedLeaf) == 0 && m_.plans[root].need > kMaxStackBound;
  }

  /// As LBVH, whose trees are never too deep.
  __device__ void climb_again() {
    for (std::uint32_t i = threadIdx.x; i < m_.state.counts.leaves; i += kThreads) m_.met[i] = kInvalidId;
    __syncthreads();
    climb(false);
  }

  __device__ void write() {
    using Layout = PlanesLayout;
    const NodePlaces places(sizeof(Layout::Node), false);
    const NodeArray<Layout::Node> nodes(job_.base + job_.nodes_offset + places.offset(first_), places);
    auto* leaves = reinterpret_cast<Layout::Leaf*>(job_.base + job_.leaves_offset) + first_;
    const WideWriter<Layout> writer{geometries(),
                                    m_.nodes,
                                    m_.plans,
                                    m_.primitives,
                                    nodes,
                                    leaves,
                                    nullptr,
                                    job_.nodes_offset + std::uint64_t{first_} * sizeof(Layout::Node),
                                    job_.leaves_offset + std::uint64_t{first_} * sizeof(Layout::Leaf)};
    const WideQueue queue{m_.plans};
    const LinkedRef root = m_.state.root;
    for (std::uint32_t i = threadIdx.x; i < m_.state.counts.leaves; i += kThreads)
      begin_wide(writer, queue, root, i, m_.progress);
    __syncthreads();
    __shared__ OwnTasks<1> own[kThreads / WaveGroup::kLanes];
    write_wide(writer, queue, root, kMost, m_.progress, m_.state.stack_need, own[threadIdx.x / WaveGroup::kLanes]);
  }

  __device__ void finish() const {
    const GroupCounts& counts = m_.state.counts;
    const LinkedRef root = m_.state.root;
    const bool is_run = counts.leaves != 0 && ((root & kLinkedLeaf) != 0 || m_.plans[root].is_run());
    SceneView view;
    view.base = job_.base;
    view.size = job_.size;
    view.geometries = job_.record(mesh_);
    const bool custom = m_.geometry.is_custom();
    if (is_run)
      view.root = make_ref(job_.leaves_offset + std::uint64_t{first_} * sizeof(PlanesLeaf),
                           custom ? NodeType::kProcedural : NodeType::kTriangle0);
    else if (counts.leaves != 0)
      view.root = make_ref(job_.nodes_offset + std::uint64_t{first_} * sizeof(PlanesBoxNode), NodeType::kBox32);
    view.stack_bound = m_.state.stack_need;
    view.features = counts.leaves == 0 ? 0 : feature_bit(custom ? Feature::kCustom : Feature::kTriangles);
    if (m_.geometry.mask != 0xffffffffu) view.features |= feature_bit(Feature::kMasks);
    view.layout = NodeLayout::kPlanes;
    view.bounds = m_.state.bounds.get();
    job_.views[mesh_] = view;
    job_.counts[mesh_] = {counts.leaves == 0 || is_run ? 0u : m_.plans[root].nodes, counts.leaves};
    if (job_.geometries != nullptr) {
      const std::uint32_t dropped =
          counts.dropped[kNotFinite] + counts.dropped[kDegenerate] + counts.dropped[kBadIndex];
      *job_.record(mesh_) = GeometryRecord{0, count_, dropped, m_.geometry.mask, m_.geometry.flags};
    }
    const auto dropped = [&](DropReason reason, std::uint32_t& sum) {
      const std::uint32_t count = counts.dropped[reason];
      if (count != 0) fetch_add(&sum, count);
    };
    dropped(kNotFinite, job_.report->dropped_not_finite);
    dropped(kDegenerate, job_.report->dropped_degenerate);
    dropped(kBadIndex, job_.report->bad_indices);
  }

  const BatchJob& job_;
  Memory& m_;
  std::uint32_t mesh_, first_, count_;
};

/// Block i makes the BVH of mesh i if it has more than @p above triangles, up to kMost.
template <unsigned kMost, unsigned kThreads>
__global__ void __launch_bounds__(kThreads) build_batch(BatchJob job, std::uint32_t begin, int above) {
  __shared__ BatchMemory<kMost, kThreads> memory;
  const std::uint32_t mesh = begin + blockIdx.x;
  const std::uint32_t count = job.first[mesh + 1] - job.first[mesh];
  if (static_cast<int>(count) <= above || count > kMost) return;
  BatchBlock<kMost, kThreads>(job, memory, mesh).run();
}

/// Numbers of primitives, and 0 at the end.
static __global__ void __launch_bounds__(kBlock)
    count_primitives(const gpu::DeviceGeometry* geometries, std::uint32_t count, std::uint32_t* counts) {
  const std::uint32_t i = thread_index();
  if (i <= count) counts[i] = i < count ? geometries[i].primitive_count : 0;
}

static __global__ void start_batch(gpu::BatchReport report, gpu::BatchReport* to, GeometryRecord* record) {
  *to = report;
  *record = GeometryRecord{0, 0, 0, 0xffffffffu, 0};
}

/// A mesh that was too large for a block.
static __global__ void adopt_scene(const gpu::BuildReport* from, SceneView* to, gpu::BatchCounts* counts,
                                   gpu::BatchReport* report) {
  *to = from->view;
  *counts = from->view.root == kInvalidRef ? gpu::BatchCounts{} : gpu::BatchCounts{from->nodes, from->leaves, 1};
  report->bad_indices += from->bad_indices;
  report->dropped_not_finite += from->dropped_not_finite;
  report->dropped_degenerate += from->dropped_degenerate;
  if (from->status == gpu::BuildStatus::kTooDeep) ++report->too_deep;
}

}  // namespace hiprt::build::kernels
