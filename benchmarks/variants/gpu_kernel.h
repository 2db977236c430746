#pragma once
/// The kernel of all GPU variants, and the types behind the values of the axes. Only the generated .hip files include
/// it.

#include "box_set.h"
#include "gpu_kernels.h"

#include <hiprt_build/gpu/hip.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/query/batch.h>
#include <hiprt_device/traverse/hardware_policies.h>
#include <hiprt_device/traverse/stacks/restart.h>
#include <hiprt_device/traverse/stacks/rolling.h>
#include <hiprt_device/traverse/stacks/shared.h>
#include <hiprt_device/traverse/stacks/tiered.h>

#include <type_traits>

namespace hiprt::bench {

template <class TriangleType, class BoxesType> struct Tests {
  using Triangle = TriangleType;
  using Boxes = BoxesType;
};

template <FeatureMask kMask, class FilterType = NoFilter, class PrimitivesType = NoPrimitives, unsigned kLevelCount = 0,
          bool kMotion = false, bool kIsPlaced = false>
struct FeatureSet {
  static constexpr bool kPlaced = kIsPlaced;
  static constexpr FeatureMask kFeatures = kMask;
  static constexpr unsigned kLevels = kLevelCount;
  static constexpr bool kMoves = kMotion;
  using Filter = FilterType;
  using Primitives = PrimitivesType;
};
inline constexpr FeatureMask kTriangleBit = feature_bit(Feature::kTriangles);
inline constexpr FeatureMask kSplitBits = kTriangleBit | feature_bit(Feature::kSplitReferences);
inline constexpr FeatureMask kMaskBits = kSplitBits | feature_bit(Feature::kMasks);
using TrianglesOnly = FeatureSet<kTriangleBit>;
using WithSplits = FeatureSet<kSplitBits>;
using WithMasks = FeatureSet<kMaskBits>;
using WithFilter = FeatureSet<kMaskBits, ExceptPrimitive>;
using WithCustom = FeatureSet<kMaskBits | feature_bit(Feature::kCustom), NoFilter, PrimitiveList<BoxSet>>;
using WithCustomAndFilter =
    FeatureSet<kMaskBits | feature_bit(Feature::kCustom), ExceptPrimitive, PrimitiveList<BoxSet>>;

template <unsigned kLevels>
using WithLevels = FeatureSet<kMaskBits | feature_bit(Feature::kInstances), NoFilter, NoPrimitives, kLevels>;
/// A scene that is one instance (PlacedObject). Levels are counted within its object.
using Placed = FeatureSet<kMaskBits, NoFilter, NoPrimitives, 0, false, true>;
template <unsigned kLevels>
using WithMotion = FeatureSet<kMaskBits | feature_bit(Feature::kInstances) | feature_bit(Feature::kMotion), NoFilter,
                              NoPrimitives, kLevels, true>;

/// Memory of a thread's stack. with(job, use) calls use(storage).
struct PrivateStorage {
  using Stack = PrivateStack<192>;
  static constexpr SpillUse kSpill = SpillUse::kNone;
  static constexpr std::uint32_t kOnChip = 192;
  template <unsigned kBlock, class Use> static __device__ HIPRT_FORCE_INLINE void with(const GpuJob& job, Use&& use) {
    Stack::Memory memory;
    use(Stack::Storage(memory, job.overflowed));
  }
};

/// PrivateStorage with the state per level of instances (PathMemory) in shared memory.
struct SharedPathStorage : PrivateStorage {};

/// The first entries in shared memory, the others in local memory.
template <unsigned kShared> struct TieredStorage {
  using Stack = TieredStack<kShared>;
  static constexpr SpillUse kSpill = SpillUse::kNone;
  static constexpr std::uint32_t kOnChip = 192;
  template <unsigned kBlock, class Use> static __device__ HIPRT_FORCE_INLINE void with(const GpuJob& job, Use&& use) {
    __shared__ StackEntry entries[kBlock * Stack::kEntriesPerThread];
    typename Stack::Memory memory;
    use(typename Stack::Storage(entries, threadIdx.x, kBlock, memory, job.overflowed));
  }
};

/// TieredStorage with PathMemory in shared memory.
template <unsigned kShared> struct TieredPathStorage : TieredStorage<kShared> {};

/// Shared memory only. Rays that need more entries fail and are counted.
struct SharedStorage {
  using Stack = SharedStack<24>;
  static constexpr SpillUse kSpill = SpillUse::kNone;
  static constexpr std::uint32_t kOnChip = 24;
  template <unsigned kBlock, class Use> static __device__ HIPRT_FORCE_INLINE void with(const GpuJob& job, Use&& use) {
    __shared__ StackEntry entries[kBlock * Stack::kEntriesPerThread];
    use(Stack::Storage(entries, threadIdx.x, kBlock, job.overflowed));
  }
};

template <unsigned kBlock> __device__ HIPRT_FORCE_INLINE Spill own_spill(const GpuJob& job) {
  return grid_spill(job.spill, job.spill_threads, job.spill_entries, blockIdx.x * kBlock + threadIdx.x);
}

struct RollingStorage {
  using Stack = RollingStack<8>;
  static constexpr SpillUse kSpill = SpillUse::kGrid;
  static constexpr std::uint32_t kOnChip = 8;
  template <unsigned kBlock, class Use> static __device__ HIPRT_FORCE_INLINE void with(const GpuJob& job, Use&& use) {
    __shared__ StackEntry ring[kBlock * Stack::kEntriesPerThread];
    use(Stack::Storage(ring, threadIdx.x, kBlock, own_spill<kBlock>(job), job.overflowed));
  }
};

/// RollingStorage that spills into slots, which waves take while they run.
struct RollingPoolStorage {
  using Stack = RollingStack<8>;
  static constexpr SpillUse kSpill = SpillUse::kPool;
  static constexpr std::uint32_t kOnChip = 8;
  template <unsigned kBlock, class Use> static __device__ HIPRT_FORCE_INLINE void with(const GpuJob& job, Use&& use) {
    __shared__ StackEntry ring[kBlock * Stack::kEntriesPerThread];
    const WaveSlot slot(job.pool, blockIdx.x);
    use(Stack::Storage(ring, threadIdx.x, kBlock, slot.spill(), job.overflowed));
  }
};

struct GlobalStorage {
  using Stack = GlobalStack;
  static constexpr SpillUse kSpill = SpillUse::kGrid;
  static constexpr std::uint32_t kOnChip = 0;
  template <unsigned kBlock, class Use> static __device__ HIPRT_FORCE_INLINE void with(const GpuJob& job, Use&& use) {
    use(Stack::Storage(own_spill<kBlock>(job), job.overflowed));
  }
};

struct RestartStorage {
  using Stack = RestartStack<4>;
  static constexpr SpillUse kSpill = SpillUse::kNone;
  static constexpr std::uint32_t kOnChip = 192;
  template <unsigned kBlock, class Use> static __device__ HIPRT_FORCE_INLINE void with(const GpuJob& job, Use&& use) {
    Stack::Storage storage;
    storage.overflowed_rays = job.overflowed;
    use(storage);
  }
};

template <class LayoutType, class Storage, class ScheduleType, class Tests, class Order, class FeaturesType,
          Answer kAnswerKind = Answer::kId>
struct VariantPolicies : Policies {
  using Layout = LayoutType;
  using Triangle = typename Tests::Triangle;
  using Boxes = typename Tests::Boxes;
  using Lanes = ArrayLanes;
  static constexpr FeatureMask kFeatures = FeaturesType::kFeatures;
  static constexpr Answer kAnswer = kAnswerKind;
  using Schedule = ScheduleType;
  using ClosestOrder = Order;
  using AnyOrder = Order;
  using StackStorage = Storage;
  using FeatureChoice = FeaturesType;
  static constexpr unsigned kLevels = FeaturesType::kLevels;
  static constexpr bool kMoves = FeaturesType::kMoves;
  using Stack = std::conditional_t<kLevels != 0, LevelStack<typename Storage::Stack, kLevels>, typename Storage::Stack>;
};

template <Answer kAnswer> __device__ HIPRT_FORCE_INLINE Ray load_ray(const GpuJob& job, std::uint32_t i) {
  if constexpr (kAnswer == Answer::kHit) return static_cast<const Ray*>(job.rays)[i];
  const std::byte* record = static_cast<const std::byte*>(job.rays) + std::size_t{32} * i;
  const Words a = load_words(record), b = load_words(record + 16);
  return {{a.as_float(0), a.as_float(1), a.as_float(2)},
          a.as_float(3),
          {b.as_float(0), b.as_float(1), b.as_float(2)},
          b.as_float(3),
          0xffffffffu,
          ray_time(i)};
}

template <class Choice> __device__ HIPRT_FORCE_INLINE typename Choice::Filter make_filter(const GpuJob& job) {
  if constexpr (std::is_same_v<typename Choice::Filter, ExceptPrimitive>)
    return job.filter;
  else
    return {};
}

template <class Choice> __device__ HIPRT_FORCE_INLINE typename Choice::Primitives make_primitives(const GpuJob& job) {
  if constexpr (Choice::Primitives::kCount != 0)
    return {BoxSet{job.boxes}};
  else
    return {};
}

/// The second launch bound for @p blocks blocks per multiprocessor. CUDA takes this number; HIP takes waves per SIMD,
/// and a compute unit has four SIMDs.
constexpr unsigned least_resident(unsigned block, unsigned blocks) {
#if defined(__HIP_DEVICE_COMPILE__)
#if defined(__GFX9__)
  constexpr unsigned kWave = 64;
#else
  constexpr unsigned kWave = 32;
#endif
  const unsigned waves = blocks * block / (4 * kWave);
  return waves == 0 ? 1 : waves > 8 ? 8 : waves;
#else
  static_cast<void>(block);
  return blocks;
#endif
}

template <Query kQuery, class P, class Filter, class Primitives> struct QueryOf {
  using Type = ClosestHit<P, Filter, Primitives>;
};
template <class P, class Filter, class Primitives> struct QueryOf<Query::kAny, P, Filter, Primitives> {
  using Type = OneHit<P, Filter, Primitives>;
};
template <class P, class Filter, class Primitives> struct QueryOf<Query::kAll, P, Filter, Primitives> {
  using Type = AllHits<P, Filter, Primitives>;
};

template <Answer kAnswer> __device__ HIPRT_FORCE_INLINE void store(const GpuJob& job, std::uint32_t i, const Hit& hit) {
  if constexpr (kAnswer == Answer::kHit)
    static_cast<Hit*>(job.results)[i] = hit;
  else
    static_cast<RayResult*>(job.results)[i] = make_result(hit);
}

template <Answer kAnswer, Query kQuery, class QueryType>
__device__ HIPRT_FORCE_INLINE void run_query(const GpuJob& job, std::uint32_t i, QueryType& query) {
  if constexpr (kQuery == Query::kAll) {
    static_assert(kAnswer == Answer::kId);
    static_cast<RayResult*>(job.results)[i] = sum_of_hits(query);
  } else {
    query.advance();
    store<kAnswer>(job, i, query.hit());
  }
}

template <class Storage> inline constexpr bool kSharesPath = std::is_same_v<Storage, SharedPathStorage>;
template <unsigned kShared> inline constexpr bool kSharesPath<TieredPathStorage<kShared>> = true;

/// Calls use(storage of P's stack).
template <class P, unsigned kBlock, class Use>
__device__ HIPRT_FORCE_INLINE void with_storage(const GpuJob& job, Use&& use) {
  P::StackStorage::template with<kBlock>(job, [&](const auto& storage) {
    if constexpr (kSharesPath<typename P::StackStorage>) {
      __shared__ PathMemory<P::kLevels> path_memory[kBlock];
      use(typename P::Stack::Storage(storage, path_memory[threadIdx.x]));
    } else if constexpr (P::kLevels != 0) {
      PathMemory<P::kLevels> path_memory;
      use(typename P::Stack::Storage(storage, path_memory));
    } else {
      use(storage);
    }
  });
}

/// Traces the rays of one thread.
template <class P, Query kQuery, unsigned kBlock> __device__ HIPRT_FORCE_INLINE void trace(const GpuJob& job) {
  using Choice = typename P::FeatureChoice;
  using QueryType = typename QueryOf<kQuery, P, typename Choice::Filter, typename Choice::Primitives>::Type;
  with_storage<P, kBlock>(job, [&](const auto& storage) {
    const auto make = [&](std::uint32_t i) {
      if constexpr (Choice::kPlaced)
        return QueryType(job.object,
                         PlacedObject{job.scene, job.object, job.instance}.to_object(load_ray<P::kAnswer>(job, i)),
                         storage);
      else
        return QueryType(job.scene, load_ray<P::kAnswer>(job, i), storage, make_filter<Choice>(job),
                         make_primitives<Choice>(job));
    };
    if constexpr (P::Schedule::kBatchOnly) {
      trace_batch(job.count, job.next, make,
                  [&](std::uint32_t i, const QueryType& query) { store<P::kAnswer>(job, i, query.hit()); });
    } else {
      const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
      if (i >= job.count) return;
      QueryType query = make(i);
      run_query<P::kAnswer, kQuery>(job, i, query);
    }
  });
}

template <class P>
inline constexpr bool kNeedsRayInstruction =
    std::is_same_v<typename P::Boxes, HardwareBoxes> || std::is_same_v<typename P::Triangle, HardwareTriangle>;

/// @tparam kBlock threads per block. @tparam kBlocks least number of blocks per multiprocessor.
template <class P, Query kQuery, unsigned kBlock, unsigned kBlocks>
__global__ void __launch_bounds__(kBlock, least_resident(kBlock, kBlocks)) trace_rays(GpuJob job) {
  if constexpr (kHasRayInstruction || !kNeedsRayInstruction<P>) trace<P, kQuery, kBlock>(job);
}

template <class P, Query kQuery, unsigned kBlock, unsigned kBlocks>
void add_kernel(std::vector<GpuKernel>& kernels, const VariantName& name) {
  using Storage = typename P::StackStorage;
  kernels.push_back({name, kQuery, P::kAnswer, &trace_rays<P, kQuery, kBlock, kBlocks>, kBlock, P::Schedule::kBatchOnly,
                     Storage::kSpill, Storage::kOnChip,
                     P::kFeatures | (P::FeatureChoice::kPlaced ? feature_bit(Feature::kInstances) : 0),
                     P::FeatureChoice::kPlaced ? 1 : P::kLevels, P::FeatureChoice::kPlaced, kNeedsRayInstruction<P>});
}

}  // namespace hiprt::bench
