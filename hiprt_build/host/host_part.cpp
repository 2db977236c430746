#include <hiprt_build/host/host_part.h>

#include <hiprt_build/format/view.h>
#include <hiprt_build/host/host_nodes.h>
#include <hiprt_build/host/host_trace.h>
#include <hiprt_build/host/isa.h>

#include <hiprt_device/host_scene.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <new>
#include <string_view>
#include <utility>

namespace hiprt {
namespace {

/// The best tracer for this processor; nullptr: there is none.
const HostTracer* host_tracer() {
#ifdef HIPRT_HOST_ISA_LIST
  struct Variant {
    std::string_view name;
    const HostTracer& (*tracer)();
  };
  static constexpr Variant kVariants[] = {
#define HIPRT_ISA(name) {#name, &format_detail::host_tracer_##name},
      HIPRT_HOST_ISA_LIST
#undef HIPRT_ISA
  };
  static const Variant& best = format_detail::best_isa(kVariants);
  return format_detail::runs_isa(best.name) ? &best.tracer() : nullptr;
#else
  return nullptr;
#endif
}

}  // namespace

struct HostPart::State {
  std::mutex mutex;
  format_detail::HostNodes nodes;
  HostScene scene;
  bool tried = false;

  void prepare(const BufferView& file, const HostTracer& tracer) {
    if (tried && scene.checksum == file.header->checksum) return;
    tried = true;
    scene = {.checksum = file.header->checksum, .tracer = tracer};
    nodes = {};
    try {
      nodes = format_detail::make_host_nodes(file);
    } catch (const std::bad_alloc&) {
      return;
    }
    if (nodes.empty()) return;
    scene.nodes = nodes.data();
    scene.bytes = nodes.size() * sizeof(HostNode) + file.leaves.count * sizeof(PlanesLeaf);
    for (unsigned axis = 0; axis < 3; ++axis) {
      scene.low[axis] = file.header->bounds.min[axis];
      scene.high[axis] = file.header->bounds.max[axis];
      scene.extent = std::max(scene.extent, scene.high[axis] - scene.low[axis]);
      scene.magnitude = std::max({scene.magnitude, std::abs(scene.low[axis]), std::abs(scene.high[axis])});
    }
  }
};

HostPart::HostPart() : state_(new State) {}
HostPart::HostPart(HostPart&& other) noexcept : state_(std::exchange(other.state_, nullptr)) {}
HostPart& HostPart::operator=(HostPart&& other) noexcept {
  std::swap(state_, other.state_);
  return *this;
}
HostPart::~HostPart() { delete state_; }

SceneView HostPart::scene(const BufferView& file) const {
  SceneView view = make_scene_view(file);
  const HostTracer* tracer = host_tracer();
  if (tracer == nullptr) return view;
  const std::lock_guard lock(state_->mutex);
  state_->prepare(file, *tracer);
  if (state_->scene.nodes != nullptr) view.host = &state_->scene;
  return view;
}

}  // namespace hiprt
