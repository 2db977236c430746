#pragma once
/// THE kernel of all GPU variants, and the types behind the names of the axes' values. Included by the generated .hip
/// files only.

#include "box_set.h"
#include "gpu_kernels.h"

#include <hip/hip_runtime.h>
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
/// A scene that is one instance (PlacedObject). The levels are those of its object.
using Placed = FeatureSet<kMaskBits, NoFilter, NoPrimitives, 0, false, true>;
template <unsigned kLevels>
using WithMotion = FeatureSet<kMaskBits | feature_bit(Feature::kInstances) | feature_bit(Feature::kMotion), NoFilter,
                              NoPrimitives, kLevels, true>;

/// Where a thread's stack is: with(job, use) calls use(storage).
struct PrivatePlace {
  using Stack = PrivateStack<192>;
  static constexpr SpillUse kSpill = SpillUse::kNone;
  static constexpr std::uint32_t kOnChip = 192;
  template <unsigned kBlock, class Use> static __device__ HIPRT_INLINE void with(const GpuJob& job, Use&& use) {
    Stack::Memory memory;
    use(Stack::Storage(memory, job.overflowed));
  }
};

/// The same, with what rays of instances need on their ways in and out (LevelWays) in shared memory.
struct SharedWaysPlace : PrivatePlace {};

/// The first entries in shared memory, the others in the thread's own.
template <unsigned kShared> struct TieredPlace {
  using Stack = TieredStack<kShared>;
  static constexpr SpillUse kSpill = SpillUse::kNone;
  static constexpr std::uint32_t kOnChip = 192;
  template <unsigned kBlock, class Use> static __device__ HIPRT_INLINE void with(const GpuJob& job, Use&& use) {
    __shared__ StackEntry entries[kBlock * Stack::kEntriesPerThread];
    typename Stack::Memory memory;
    use(typename Stack::Storage(entries, threadIdx.x, kBlock, memory, job.overflowed));
  }
};

/// The same, with LevelWays in shared memory.
template <unsigned kShared> struct TieredWaysPlace : TieredPlace<kShared> {};

/// No global memory: rays that need more entries fail, and are counted.
struct SharedPlace {
  using Stack = SharedStack<24>;
  static constexpr SpillUse kSpill = SpillUse::kNone;
  static constexpr std::uint32_t kOnChip = 24;
  template <unsigned kBlock, class Use> static __device__ HIPRT_INLINE void with(const GpuJob& job, Use&& use) {
    __shared__ StackEntry entries[kBlock * Stack::kEntriesPerThread];
    use(Stack::Storage(entries, threadIdx.x, kBlock, job.overflowed));
  }
};

template <unsigned kBlock> __device__ HIPRT_INLINE Spill own_spill(const GpuJob& job) {
  return grid_spill(job.spill, job.spill_threads, job.spill_entries, blockIdx.x * kBlock + threadIdx.x);
}

struct RollingPlace {
  using Stack = RollingStack<8>;
  static constexpr SpillUse kSpill = SpillUse::kGrid;
  static constexpr std::uint32_t kOnChip = 8;
  template <unsigned kBlock, class Use> static __device__ HIPRT_INLINE void with(const GpuJob& job, Use&& use) {
    __shared__ StackEntry ring[kBlock * Stack::kEntriesPerThread];
    use(Stack::Storage(ring, threadIdx.x, kBlock, own_spill<kBlock>(job), job.overflowed));
  }
};

/// The same with slots that waves take while they run.
struct RollingPoolPlace {
  using Stack = RollingStack<8>;
  static constexpr SpillUse kSpill = SpillUse::kPool;
  static constexpr std::uint32_t kOnChip = 8;
  template <unsigned kBlock, class Use> static __device__ HIPRT_INLINE void with(const GpuJob& job, Use&& use) {
    __shared__ StackEntry ring[kBlock * Stack::kEntriesPerThread];
    const WaveSlot slot(job.pool, blockIdx.x);
    use(Stack::Storage(ring, threadIdx.x, kBlock, slot.spill(), job.overflowed));
  }
};

struct GlobalPlace {
  using Stack = GlobalStack;
  static constexpr SpillUse kSpill = SpillUse::kGrid;
  static constexpr std::uint32_t kOnChip = 0;
  template <unsigned kBlock, class Use> static __device__ HIPRT_INLINE void with(const GpuJob& job, Use&& use) {
    use(Stack::Storage(own_spill<kBlock>(job), job.overflowed));
  }
};

struct RestartPlace {
  using Stack = RestartStack<4>;
  static constexpr SpillUse kSpill = SpillUse::kNone;
  static constexpr std::uint32_t kOnChip = 192;
  template <unsigned kBlock, class Use> static __device__ HIPRT_INLINE void with(const GpuJob& job, Use&& use) {
    Stack::Storage storage;
    storage.overflowed_rays = job.overflowed;
    use(storage);
  }
};

template <class LayoutType, class Place, class ScheduleType, class Tests, class Order, class FeaturesType>
struct VariantPolicies : Policies {
  using Layout = LayoutType;
  using Triangle = typename Tests::Triangle;
  using Boxes = typename Tests::Boxes;
  using Lanes = ArrayLanes;
  static constexpr FeatureMask kFeatures = FeaturesType::kFeatures;
  using Schedule = ScheduleType;
  using ClosestOrder = Order;
  using AnyOrder = Order;
  using StackPlace = Place;
  using FeatureChoice = FeaturesType;
  static constexpr unsigned kLevels = FeaturesType::kLevels;
  static constexpr bool kMoves = FeaturesType::kMoves;
  using Stack = std::conditional_t<kLevels != 0, LevelStack<typename Place::Stack, kLevels>, typename Place::Stack>;
};

__device__ HIPRT_INLINE Ray load_ray(const GpuJob& job, std::uint32_t i) {
  const std::byte* record = static_cast<const std::byte*>(job.rays) + std::size_t{32} * i;
  const Words a = load_words(record), b = load_words(record + 16);
  return {{a.as_float(0), a.as_float(1), a.as_float(2)},
          a.as_float(3),
          {b.as_float(0), b.as_float(1), b.as_float(2)},
          b.as_float(3),
          0xffffffffu,
          ray_time(i)};
}

template <class Choice> __device__ HIPRT_INLINE typename Choice::Filter make_filter(const GpuJob& job) {
  if constexpr (std::is_same_v<typename Choice::Filter, ExceptPrimitive>)
    return job.filter;
  else
    return {};
}

template <class Choice> __device__ HIPRT_INLINE typename Choice::Primitives make_primitives(const GpuJob& job) {
  if constexpr (Choice::Primitives::kCount != 0)
    return {BoxSet{job.boxes}};
  else
    return {};
}

/// The second launch bound of @p blocks blocks per multiprocessor: CUDA takes that number, HIP waves per SIMD, of which
/// a compute unit has four.
constexpr unsigned least_resident(unsigned block, unsigned blocks) {
#if defined(__HIP_DEVICE_COMPILE__)
  const unsigned waves = blocks * block / (4 * __AMDGCN_WAVEFRONT_SIZE);
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
  using Type = AnyHit<P, Filter, Primitives>;
};
template <class P, class Filter, class Primitives> struct QueryOf<Query::kAll, P, Filter, Primitives> {
  using Type = AllHits<P, Filter, Primitives>;
};

template <Query kQuery, class Asked> __device__ HIPRT_INLINE Answer ask(Asked& query) {
  if constexpr (kQuery == Query::kAll) {
    return sum_of_hits(query);
  } else {
    query.advance();
    return make_answer(query.hit());
  }
}

template <class Place> inline constexpr bool kSharesWays = std::is_same_v<Place, SharedWaysPlace>;
template <unsigned kShared> inline constexpr bool kSharesWays<TieredWaysPlace<kShared>> = true;

/// use(storage of P's stack).
template <class P, unsigned kBlock, class Use> __device__ HIPRT_INLINE void with_storage(const GpuJob& job, Use&& use) {
  P::StackPlace::template with<kBlock>(job, [&](const auto& storage) {
    if constexpr (kSharesWays<typename P::StackPlace>) {
      __shared__ LevelWays<P::kLevels> ways[kBlock];
      use(typename P::Stack::Storage(storage, ways[threadIdx.x]));
    } else if constexpr (P::kLevels != 0) {
      LevelWays<P::kLevels> ways;
      use(typename P::Stack::Storage(storage, ways));
    } else {
      use(storage);
    }
  });
}

/// The rays of one thread.
template <class P, Query kQuery, unsigned kBlock> __device__ HIPRT_INLINE void trace(const GpuJob& job) {
  using Choice = typename P::FeatureChoice;
  using Asked = typename QueryOf<kQuery, P, typename Choice::Filter, typename Choice::Primitives>::Type;
  with_storage<P, kBlock>(job, [&](const auto& storage) {
    const auto make = [&](std::uint32_t i) {
      if constexpr (Choice::kPlaced)
        return Asked(job.object, PlacedObject{job.scene, job.object, job.instance}.to_object(load_ray(job, i)),
                     storage);
      else
        return Asked(job.scene, load_ray(job, i), storage, make_filter<Choice>(job), make_primitives<Choice>(job));
    };
    if constexpr (P::Schedule::kBatchOnly) {
      trace_batch(job.count, job.next, make,
                  [&](std::uint32_t i, const Asked& query) { job.answers[i] = make_answer(query.hit()); });
    } else {
      const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
      if (i >= job.count) return;
      Asked query = make(i);
      job.answers[i] = ask<kQuery>(query);
    }
  });
}

template <class P>
inline constexpr bool kNeedsRayInstruction =
    std::is_same_v<typename P::Boxes, HardwareBoxes> || std::is_same_v<typename P::Triangle, HardwareTriangle>;

/// @tparam kBlock threads of a block. @tparam kBlocks of a multiprocessor, at least.
template <class P, Query kQuery, unsigned kBlock, unsigned kBlocks>
__global__ void __launch_bounds__(kBlock, least_resident(kBlock, kBlocks)) trace_rays(GpuJob job) {
  if constexpr (kHasRayInstruction || !kNeedsRayInstruction<P>) trace<P, kQuery, kBlock>(job);
}

template <class P, Query kQuery, unsigned kBlock, unsigned kBlocks>
void add_kernel(std::vector<GpuKernel>& kernels, const VariantName& name) {
  using Place = typename P::StackPlace;
  kernels.push_back({name, kQuery, &trace_rays<P, kQuery, kBlock, kBlocks>, kBlock, P::Schedule::kBatchOnly,
                     Place::kSpill, Place::kOnChip,
                     P::kFeatures | (P::FeatureChoice::kPlaced ? feature_bit(Feature::kInstances) : 0),
                     P::FeatureChoice::kPlaced ? 1 : P::kLevels, P::FeatureChoice::kPlaced, kNeedsRayInstruction<P>});
}

}  // namespace hiprt::bench
