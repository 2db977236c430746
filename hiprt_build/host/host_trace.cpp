/// Compiled once per instruction set (HIPRT_ISA_NAME).

#include <hiprt_build/host/coherent_search.h>
#include <hiprt_build/host/host_trace.h>

#include <new>

#define HIPRT_JOIN_EXPANDED(a, b) a##b
#define HIPRT_JOIN(a, b) HIPRT_JOIN_EXPANDED(a, b)

namespace hiprt::format_detail {
namespace {

Hit trace_closest(const SceneView& scene, const Ray& ray) { return HostSearch<true>(scene, ray).run(); }

Hit trace_any(const SceneView& scene, const Ray& ray) { return HostSearch<false>(scene, ray).run(); }

/// Rays of a call, in the order of the caller. @tparam kClosest as that of HostSearch.
template <bool kClosest> class RayQueue {
 public:
  RayQueue(const SceneView& scene, const Ray* rays, Hit* hits, std::size_t count)
      : scene_(&scene), rays_(rays), hits_(hits), count_(count) {}

  /// Traces windows of coherent rays at once. @return the next ray that remains; kNone: there are no more.
  std::size_t take() {
    if (next_ % kCoherentRays == 0) trace_coherent();
    return next_ < count_ ? next_++ : kNone;
  }
  const Ray& ray(std::size_t number) const { return rays_[number]; }
  Hit& hit(std::size_t number) { return hits_[number]; }

  static constexpr std::size_t kNone = ~std::size_t{0};

 private:
  [[gnu::noinline]] void trace_coherent() {
    for (CoherentRays rays; next_ + kCoherentRays <= count_ && rays.prepare(*scene_->host, rays_ + next_);
         next_ += kCoherentRays)
      CoherentSearch<kClosest>(*scene_, rays_ + next_, rays).run(hits_ + next_);
  }

  const SceneView* scene_;
  const Ray* rays_;
  Hit* hits_;
  std::size_t count_, next_ = 0;
};

/// A search in memory that is used again and again: a copy takes as long as a visit of a node.
template <bool kClosest> struct Slot {
  using Search = HostSearch<kClosest>;
  using Queue = RayQueue<kClosest>;

  alignas(Search) std::byte memory[sizeof(Search)];
  std::size_t ray = Queue::kNone;

  Search& search() { return *std::launder(reinterpret_cast<Search*>(memory)); }
  /// Starts the next ray, if there is one.
  void start(const SceneView& scene, Queue& queue) {
    static_assert(std::is_trivially_destructible_v<Search>);
    ray = queue.take();
    if (ray != Queue::kNone) new (memory) Search(scene, queue.ray(ray));
  }
};

/// Traces eight rays in turn, a node of each at a time. While memory is read for one ray, others are tested.
template <bool kClosest> void trace_in_turn(const SceneView& scene, RayQueue<kClosest>& queue) {
  using Queue = RayQueue<kClosest>;
  Slot<kClosest> slots[8];
  for (auto& slot : slots) slot.start(scene, queue);
  for (bool busy = true; busy;) {
    busy = false;
    for (auto& slot : slots) {
      if (slot.ray == Queue::kNone) continue;
      busy = true;
      if (slot.search().step()) continue;
      queue.hit(slot.ray) = slot.search().hit();
      slot.start(scene, queue);
    }
  }
}

/// Trees of more bytes than this do not fit into the caches of common processors.
constexpr std::uint64_t kCached = std::uint64_t{32} << 20;

template <bool kClosest> void trace_many(const SceneView& scene, const Ray* rays, Hit* hits, std::size_t count) {
  RayQueue<kClosest> queue(scene, rays, hits, count);
  if (scene.host->bytes > kCached) return trace_in_turn(scene, queue);
  for (std::size_t ray = queue.take(); ray != queue.kNone; ray = queue.take())
    queue.hit(ray) = kClosest ? trace_closest(scene, rays[ray]) : trace_any(scene, rays[ray]);
}

}  // namespace

const HostTracer& HIPRT_JOIN(host_tracer_, HIPRT_ISA_NAME)() {
  static constexpr HostTracer kTracer{trace_closest, trace_any, trace_many<true>, trace_many<false>};
  return kTracer;
}

}  // namespace hiprt::format_detail
