#pragma once
/// One kernel template for all policies and queries; for .hip sources.

#include <hiprt_device/query/batch.h>
#include <hiprt_device/traverse/stacks/private.h>
#include <hiprt_device/traverse/stacks/restart.h>
#include <hiprt_device/traverse/stacks/shared.h>
#include <hiprt_device/traverse/stacks/tiered.h>
#include <tests/gpu/traversal_job.h>

namespace hiprt::checks {

/// Where a thread's stack lies, between guard words. All threads of a block make and check it together.
template <unsigned kEntries> class InPrivate {
 public:
  using Stack = PrivateStack<kEntries>;

  __device__ explicit InPrivate(const Job&) : before_(kGuardEntry), behind_(kGuardEntry) {}
  __device__ typename Stack::Storage storage(const Job& job) { return {memory_, job.failed_rays}; }
  __device__ bool is_intact() const { return before_ == kGuardEntry && behind_ == kGuardEntry; }

 private:
  volatile StackEntry before_;
  typename Stack::Memory memory_;
  volatile StackEntry behind_;
};

/// The block's shared memory.
template <unsigned kEntries> class SharedBlock {
 public:
  __device__ SharedBlock() {
    static_assert(kGuard >= kBlock);
    begin()[threadIdx.x - kGuard] = kGuardEntry;
    end()[threadIdx.x] = kGuardEntry;
    __syncthreads();
  }
  __device__ bool is_intact() const {
    __syncthreads();
    return is_intact_here();
  }
  /// Without waiting for the block's other waves: a wave that has a slot must not wait for one that wants one.
  __device__ bool is_intact_here() const {
    return begin()[threadIdx.x - kGuard] == kGuardEntry && end()[threadIdx.x] == kGuardEntry;
  }
  __device__ static StackEntry* begin() {
    __shared__ StackEntry entries[kGuard + kEntries * kBlock + kGuard];
    return entries + kGuard;
  }

 private:
  __device__ static StackEntry* end() { return begin() + kEntries * kBlock; }
};

template <unsigned kEntries> class InShared {
 public:
  using Stack = SharedStack<kEntries>;

  __device__ explicit InShared(const Job&) {}
  __device__ typename Stack::Storage storage(const Job& job) {
    return {block_.begin(), threadIdx.x, kBlock, job.failed_rays};
  }
  __device__ bool is_intact() const { return block_.is_intact(); }

 private:
  SharedBlock<kEntries> block_;
};

template <unsigned kShared, unsigned kEntries> class InTiers {
 public:
  using Stack = TieredStack<kShared, kEntries>;

  __device__ explicit InTiers(const Job&) : before_(kGuardEntry), behind_(kGuardEntry) {}
  __device__ typename Stack::Storage storage(const Job& job) {
    return {block_.begin(), threadIdx.x, kBlock, memory_, job.failed_rays};
  }
  __device__ bool is_intact() const { return block_.is_intact() && before_ == kGuardEntry && behind_ == kGuardEntry; }

 private:
  SharedBlock<kShared> block_;
  volatile StackEntry before_;
  typename Stack::Memory memory_;
  volatile StackEntry behind_;
};

__device__ inline Spill spill_of_thread(const Job& job) {
  return grid_spill(job.spill, gridDim.x * kBlock, job.spill_entries, blockIdx.x * kBlock + threadIdx.x);
}

template <unsigned kRing> class RollingInGrid {
 public:
  using Stack = RollingStack<kRing>;

  __device__ explicit RollingInGrid(const Job&) {}
  __device__ typename Stack::Storage storage(const Job& job) {
    return {block_.begin(), threadIdx.x, kBlock, spill_of_thread(job), job.failed_rays};
  }
  __device__ bool is_intact() const { return block_.is_intact(); }

 private:
  SharedBlock<kRing> block_;
};

template <unsigned kRing> class RollingInSlot {
 public:
  using Stack = RollingStack<kRing>;

  __device__ explicit RollingInSlot(const Job& job) : slot_(job.pool, blockIdx.x) {}
  __device__ typename Stack::Storage storage(const Job& job) {
    return {block_.begin(), threadIdx.x, kBlock, slot_.spill(), job.failed_rays};
  }
  __device__ bool is_intact() const { return block_.is_intact_here(); }

 private:
  SharedBlock<kRing> block_;
  WaveSlot slot_;
};

class GlobalInSlot {
 public:
  using Stack = GlobalStack;

  __device__ explicit GlobalInSlot(const Job& job) : slot_(job.pool, blockIdx.x) {}
  __device__ Stack::Storage storage(const Job& job) { return Stack::Storage(slot_.spill(), job.failed_rays); }
  __device__ bool is_intact() const { return true; }

 private:
  WaveSlot slot_;
};

template <unsigned kEntries> class Restarting {
 public:
  using Stack = RestartStack<kEntries>;

  __device__ explicit Restarting(const Job&) {}
  __device__ typename Stack::Storage storage(const Job& job) {
    typename Stack::Storage storage;
    storage.overflowed_rays = job.failed_rays;
    return storage;
  }
  __device__ bool is_intact() const { return true; }
};

template <class LayoutPolicy, class StackMemory, class SchedulePolicy = Immediate>
struct With : WithLayout<LayoutPolicy> {
  using Stack = typename StackMemory::Stack;
  using Schedule = SchedulePolicy;
};

template <class Primitives> __device__ Primitives primitives_of(const Job& job) {
  if constexpr (Primitives::kCount == 0)
    return {};
  else
    return job.customs;
}

template <class P, Query kQuery, class Filter, class Primitives> struct QueryType;
template <class P, class Filter, class Primitives> struct QueryType<P, Query::kClosest, Filter, Primitives> {
  using Type = ClosestHit<P, Filter, Primitives>;
};
template <class P, class Filter, class Primitives> struct QueryType<P, Query::kAny, Filter, Primitives> {
  using Type = AnyHit<P, Filter, Primitives>;
};
template <class P, class Filter, class Primitives> struct QueryType<P, Query::kAll, Filter, Primitives> {
  using Type = AllHits<P, Filter, Primitives>;
};

/// The first hits of a query, at most @p most, in order.
template <class TracedQuery> __device__ QueryResult first_hits(TracedQuery& query, unsigned most) {
  QueryResult result{};
  Hit hit;
  for (unsigned i = 0; i < most; ++i) {
    hit = query.next_hit();
    if (i == 0) result.hit = hit;
    if (!hit.found()) break;
    ++result.count;
    result.digest += digest_of(hit);
  }
  result.state = query.state();
  result.failed = hit.failed();
  return result;
}

template <class TracedQuery> __device__ QueryResult result_of(const TracedQuery& query) {
  const Hit hit = query.hit();
  return {hit, query.state(), hit.failed(), hit.found(), hit.found() ? digest_of(hit) : 0};
}

/// Hits that the test takes from a query.
template <class P> constexpr unsigned depth_of(Query query) {
  return query == Query::kAll ? 0xffffffffu : query == Query::kAny || P::Schedule::kBatchOnly ? 1 : kDepth;
}

template <class P, class StackMemory, Query kQuery, class Filter, class Primitives>
__device__ void trace_rays(const Job& job) {
  using TracedQuery = typename QueryType<P, kQuery, Filter, Primitives>::Type;
  StackMemory memory(job);
  const auto storage = memory.storage(job);
  const auto make = [&](std::uint32_t ray) {
    return TracedQuery(job.scene, job.rays[ray], storage, Filter{}, primitives_of<Primitives>(job));
  };
  if constexpr (P::Schedule::kBatchOnly) {
    trace_batch(job.count, job.next, make,
                [&](std::uint32_t ray, const TracedQuery& query) { job.results[ray] = result_of(query); });
  } else if (const std::uint32_t ray = blockIdx.x * kBlock + threadIdx.x; ray < job.count) {
    TracedQuery query = make(ray);
    job.results[ray] = first_hits(query, depth_of<P>(kQuery));
  }
  if (!memory.is_intact()) fetch_add(job.broken_guards, 1);
}

template <class P, class StackMemory, Query kQuery, class Filter, class Primitives>
__global__ void __launch_bounds__(kBlock) trace(Job job) {
  trace_rays<P, StackMemory, kQuery, Filter, Primitives>(job);
}

template <class Filter> constexpr Filtering filtering_of() {
  return std::is_same_v<Filter, RejectSome>   ? Filtering::kReject
         : std::is_same_v<Filter, StopAtOnce> ? Filtering::kStop
                                              : Filtering::kNone;
}

template <class P, class StackMemory, Query kQuery = Query::kClosest, class Filter = NoFilter,
          class Primitives = NoPrimitives>
Variant variant(const char* name) {
  return {name,
          &trace<P, StackMemory, kQuery, Filter, Primitives>,
          P::Layout::kId,
          kQuery,
          filtering_of<Filter>(),
          depth_of<P>(kQuery),
          P::Schedule::kBatchOnly,
          Primitives::kCount != 0};
}

}  // namespace hiprt::checks
