// Traversal kernels as programs write them. resources.json lists their registers and memory.

#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/primitives/primitive_table.h>
#include <hiprt_device/query/batch.h>
#include <hiprt_device/traverse/hardware_policies.h>
#include <hiprt_device/traverse/stacks/restart.h>
#include <hiprt_device/traverse/stacks/rolling.h>
#include <hiprt_device/traverse/stacks/shared.h>

namespace hiprt::checks {

/// Discs in the plane z = 0.
struct Discs {
  const float* radius;
  template <class Report>
  HIPRT_HD bool intersect(const Ray& ray, float, float, std::uint32_t primitive, Report&& report) const {
    const float t = -ray.origin.z / ray.direction.z;
    const float x = ray.origin.x + t * ray.direction.x, y = ray.origin.y + t * ray.direction.y;
    if (!(x * x + y * y <= radius[primitive])) return true;
    return report(CustomHit{t, x, y, Vec3(0.0f, 0.0f, 1.0f), 1e-6f});
  }
};

namespace {

constexpr unsigned kBlock = 64;
/// As tools/render/tracers/gpu_policies.h: blocks of a multiprocessor on NVIDIA, waves of a SIMD on AMD.
#if defined(__CUDACC__)
constexpr unsigned kResident = 14;
#else
constexpr unsigned kResident = 1;
#endif
using Private = PrivateStack<64>;
using Tiered = TieredStack<16, 64>;
using Shared = SharedStack<>;
using Rolling = RollingStack<8>;
using Global = GlobalStack;
using Restart = RestartStack<4>;

struct Arguments {
  SceneView scene;
  const Ray* rays;
  Hit* hits;
  std::uint32_t count;
  std::uint32_t* next;
  StackEntry* spill;
  std::uint32_t spill_entries;
  SpillPool pool;
  const float* radius;
};

template <class Layout, class StackPolicy, class SchedulePolicy = Immediate> struct With : WithLayout<Layout> {
  using Stack = StackPolicy;
  using Schedule = SchedulePolicy;
};

struct RejectThird {
  HIPRT_HD FilterResult operator()(const Ray&, const Hit& hit) const {
    return hit.primitive % 3 == 0 ? FilterResult::kReject : FilterResult::kAccept;
  }
};

__device__ std::uint32_t thread_index() { return blockIdx.x * kBlock + threadIdx.x; }

/// Calls use(storage) with this thread's stack.
template <class Stack, class Use> __device__ void with_storage(const Arguments& arguments, Use&& use) {
  if constexpr (std::is_same_v<Stack, Private>) {
    Private::Memory memory;
    use(Private::Storage(memory));
  } else if constexpr (std::is_same_v<Stack, Tiered>) {
    __shared__ StackEntry entries[kBlock * Tiered::kEntriesPerThread];
    Tiered::Memory memory;
    use(Tiered::Storage(entries, threadIdx.x, kBlock, memory));
  } else if constexpr (std::is_same_v<Stack, Shared>) {
    __shared__ StackEntry entries[kBlock * Shared::kEntriesPerThread];
    use(Shared::Storage(entries, threadIdx.x, kBlock));
  } else if constexpr (std::is_same_v<Stack, Rolling>) {
    __shared__ StackEntry ring[kBlock * Rolling::kEntriesPerThread];
    const std::uint32_t threads = gridDim.x * kBlock;
    use(Rolling::Storage(ring, threadIdx.x, kBlock,
                         grid_spill(arguments.spill, threads, arguments.spill_entries, thread_index())));
  } else if constexpr (std::is_same_v<Stack, Global>) {
    const WaveSlot slot(arguments.pool, blockIdx.x);
    use(Global::Storage(slot.spill()));
  } else {
    use(typename Stack::Storage{});
  }
}

}  // namespace

template <class Layout, class Stack> __global__ void __launch_bounds__(kBlock) closest(Arguments arguments) {
  const std::uint32_t i = thread_index();
  with_storage<Stack>(arguments, [&](const auto& storage) {
    if (i < arguments.count)
      arguments.hits[i] = closest_hit<With<Layout, Stack>>(arguments.scene, arguments.rays[i], storage);
  });
}

template <class Layout, class Stack> __global__ void __launch_bounds__(kBlock) any(Arguments arguments) {
  const std::uint32_t i = thread_index();
  with_storage<Stack>(arguments, [&](const auto& storage) {
    if (i < arguments.count)
      arguments.hits[i] = any_hit<With<Layout, Stack>>(arguments.scene, arguments.rays[i], storage);
  });
}

/// The tools' kernels.
template <class P, class Query> __device__ HIPRT_FORCE_INLINE void trace_all(const Arguments& arguments) {
  with_storage<typename P::Stack>(arguments, [&](const auto& storage) {
    trace_batch(
        arguments.count, arguments.next,
        [&](std::uint32_t ray) { return Query(arguments.scene, arguments.rays[ray], storage); },
        [&](std::uint32_t ray, const Query& query) { arguments.hits[ray] = query.hit(); });
  });
}
template <class Layout, class Stack>
__global__ void __launch_bounds__(kBlock, kResident) closest_batch(Arguments arguments) {
  using P = With<Layout, Stack, WholeWave<>>;
  trace_all<P, ClosestHit<P>>(arguments);
}
template <class Layout, class Stack>
__global__ void __launch_bounds__(kBlock, kResident) any_batch(Arguments arguments) {
  using P = With<Layout, Stack, WholeWave<>>;
  trace_all<P, AnyHit<P>>(arguments);
}

template <class Layout, class Stack> __global__ void __launch_bounds__(kBlock) closest_filtered(Arguments arguments) {
  const std::uint32_t i = thread_index();
  with_storage<Stack>(arguments, [&](const auto& storage) {
    using Query = ClosestHit<With<Layout, Stack>, RejectThird>;
    if (i < arguments.count) arguments.hits[i] = Query(arguments.scene, arguments.rays[i], storage).next_hit();
  });
}

template <class Layout, class Stack> __global__ void __launch_bounds__(kBlock) closest_custom(Arguments arguments) {
  const std::uint32_t i = thread_index();
  with_storage<Stack>(arguments, [&](const auto& storage) {
    using Query = ClosestHit<With<Layout, Stack>, NoFilter, PrimitiveList<Discs>>;
    if (i < arguments.count)
      arguments.hits[i] = Query(arguments.scene, arguments.rays[i], storage, {}, {Discs{arguments.radius}}).next_hit();
  });
}

template <class LayoutType, class TriangleType> struct ByInstruction : HardwarePolicies {
  using Layout = LayoutType;
  using Triangle = TriangleType;
  using Stack = Rolling;
};

/// With AMD's ray instruction; empty for other GPUs.
template <class Layout, class Triangle>
__global__ void __launch_bounds__(kBlock) closest_hardware(Arguments arguments) {
  if constexpr (kHasRayInstruction) {
    const std::uint32_t i = thread_index();
    with_storage<Rolling>(arguments, [&](const auto& storage) {
      if (i < arguments.count)
        arguments.hits[i] = closest_hit<ByInstruction<Layout, Triangle>>(arguments.scene, arguments.rays[i], storage);
    });
  }
}

template __global__ void closest<PlanesLayout, Private>(Arguments);
template __global__ void closest<PlanesLayout, Tiered>(Arguments);
template __global__ void closest<PlanesLayout, Shared>(Arguments);
template __global__ void closest<PlanesLayout, Rolling>(Arguments);
template __global__ void closest<PlanesLayout, Global>(Arguments);
template __global__ void closest<PlanesLayout, Restart>(Arguments);
template __global__ void closest<QuantizedLayout, Private>(Arguments);
template __global__ void closest<QuantizedLayout, Rolling>(Arguments);
template __global__ void closest<QuantizedLayout, Restart>(Arguments);
template __global__ void any<PlanesLayout, Private>(Arguments);
template __global__ void any<PlanesLayout, Tiered>(Arguments);
template __global__ void any<PlanesLayout, Shared>(Arguments);
template __global__ void any<PlanesLayout, Rolling>(Arguments);
template __global__ void any<PlanesLayout, Global>(Arguments);
template __global__ void any<PlanesLayout, Restart>(Arguments);
template __global__ void any<QuantizedLayout, Private>(Arguments);
template __global__ void any<QuantizedLayout, Rolling>(Arguments);
template __global__ void any<QuantizedLayout, Restart>(Arguments);
template __global__ void closest_batch<PlanesLayout, Private>(Arguments);
template __global__ void closest_batch<PlanesLayout, Tiered>(Arguments);
template __global__ void closest_batch<PlanesLayout, Rolling>(Arguments);
template __global__ void closest_batch<QuantizedLayout, Rolling>(Arguments);
template __global__ void any_batch<PlanesLayout, Private>(Arguments);
template __global__ void any_batch<PlanesLayout, Rolling>(Arguments);
template __global__ void closest_filtered<QuantizedLayout, Rolling>(Arguments);
template __global__ void closest_custom<QuantizedLayout, Rolling>(Arguments);
template __global__ void closest_hardware<FloatLayout, Watertight>(Arguments);
template __global__ void closest_hardware<HalfLayout, Watertight>(Arguments);
template __global__ void closest_hardware<HalfLayout, HardwareTriangle>(Arguments);

}  // namespace hiprt::checks
