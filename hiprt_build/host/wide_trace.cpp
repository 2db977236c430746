/// Compiled once per instruction set (HIPRT_ISA_NAME).

#include <hiprt_build/host/wide_trace.h>

#include <hiprt_device/hiprt_device.h>

#include <new>

#define HIPRT_JOIN_EXPANDED(a, b) a##b
#define HIPRT_JOIN(a, b) HIPRT_JOIN_EXPANDED(a, b)

namespace hiprt::format_detail {
namespace {

struct Wide : Policies {
  using Layout = WideLayout;
  using Lanes = WideLanes;
};

/// Rays in flight, and rays whose coherence is looked at together.
constexpr unsigned kWindow = 8;

/// Whether the rays of a window are nearly parallel and close to each other. Then they visit the same nodes, and no ray
/// but the first waits for memory.
bool are_coherent(const SceneView& scene, const Ray* rays) {
  const auto extent = [&](unsigned axis) { return scene.bounds.max[axis] - scene.bounds.min[axis]; };
  const float near = 0x1p-7f * max_of(extent(0), max_of(extent(1), extent(2)));
  const float narrow = 0x1p-4f * max_component(rays[0].direction);
  for (unsigned i = 1; i < kWindow; ++i)
    if (!(max_component(rays[i].direction - rays[0].direction) <= narrow &&
          max_component(rays[i].origin - rays[0].origin) <= near))
      return false;
  return true;
}

/// Traces coherent windows from ray @p next on, ray by ray. @return the first ray that is left.
[[gnu::noinline]] std::size_t trace_coherent(const SceneView& scene, const Ray* rays, Hit* hits, std::size_t next,
                                             std::size_t count,
                                             Hit (*trace_one)(const SceneView& scene, const Ray& ray)) {
  while (next + kWindow <= count && are_coherent(scene, rays + next))
    for (const std::size_t end = next + kWindow; next < end; ++next) hits[next] = trace_one(scene, rays[next]);
  return next;
}

constexpr std::size_t kNoRay = ~std::size_t{0};

/// A ray in flight. Its query is constructed in place: a copy takes as long as a visit of a node.
template <class Query> struct Slot {
  alignas(Query) std::byte memory[sizeof(Query)];
  PrivateStack<>::Memory stack;
  std::size_t ray = kNoRay;

  Query& query() { return *reinterpret_cast<Query*>(memory); }
  void start(const SceneView& scene, const Ray* rays, std::size_t number) {
    static_assert(std::is_trivially_destructible_v<Query>);
    new (memory) Query(scene, rays[number], stack);
    ray = number;
  }
};

/// Traces rays in turn, one node of each at a time. While memory is read for one ray, others are tested.
/// @tparam Query ClosestHit<Wide> or OneHit<Wide>.
/// @param trace_one traces a ray by itself. It is called through a pointer: inlined, it would take registers from the
/// loop over the slots.
template <class Query>
void trace_in_turn(const SceneView& scene, const Ray* rays, Hit* hits, std::size_t count,
                   Hit (*trace_one)(const SceneView& scene, const Ray& ray)) {
  Slot<Query> slots[kWindow];
  std::size_t next = trace_coherent(scene, rays, hits, 0, count, trace_one);
  unsigned busy = 0;
  for (Slot<Query>& slot : slots)
    if (next < count) {
      slot.start(scene, rays, next++);
      ++busy;
    }
  while (busy > 0)
    for (Slot<Query>& slot : slots) {
      if (slot.ray == kNoRay || !slot.query().advance_wave(true)) continue;
      hits[slot.ray] = slot.query().hit();
      if (next % kWindow == 0) next = trace_coherent(scene, rays, hits, next, count, trace_one);
      if (next < count) {
        slot.start(scene, rays, next++);
      } else {
        slot.ray = kNoRay;
        --busy;
      }
    }
}

Hit trace_closest(const SceneView& scene, const Ray& ray) { return closest_hit<Wide>(scene, ray); }

Hit trace_any(const SceneView& scene, const Ray& ray) { return any_hit<Wide>(scene, ray); }

void trace_closest_hits(const SceneView& scene, const Ray* rays, Hit* hits, std::size_t count) {
  trace_in_turn<ClosestHit<Wide>>(scene, rays, hits, count, trace_closest);
}

void trace_any_hits(const SceneView& scene, const Ray* rays, Hit* hits, std::size_t count) {
  trace_in_turn<OneHit<Wide>>(scene, rays, hits, count, trace_any);
}

}  // namespace

const HostTracer& HIPRT_JOIN(wide_tracer_, HIPRT_ISA_NAME)() {
  static constexpr HostTracer kTracer{trace_closest, trace_any, trace_closest_hits, trace_any_hits};
  return kTracer;
}

}  // namespace hiprt::format_detail
