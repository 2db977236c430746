#include <hiprt_build/host/host_part.h>

#include <hiprt_build/format/view.h>
#include <hiprt_build/host/isa.h>
#include <hiprt_build/host/wide_nodes.h>
#include <hiprt_build/host/wide_trace.h>

#include <hiprt_device/host_scene.h>

#include <mutex>
#include <new>
#include <utility>

namespace hiprt {
namespace {

using format_detail::WideTracer;

/// The best tracer for this processor; nullptr: there is none.
const WideTracer* wide_tracer() {
#ifdef HIPRT_WIDE_ISA_LIST
  static const WideTracer* const best = [] {
    static constexpr WideTracer kTracers[] = {
#define HIPRT_ISA(name)                                                                 \
  {#name, &format_detail::wide_closest_hit_##name, &format_detail::wide_any_hit_##name, \
   &format_detail::wide_closest_hits_##name, &format_detail::wide_any_hits_##name},
        HIPRT_WIDE_ISA_LIST
#undef HIPRT_ISA
    };
    const WideTracer& chosen = format_detail::best_isa(kTracers);
    return format_detail::runs_isa(chosen.name) ? &chosen : nullptr;
  }();
  return best;
#else
  return nullptr;
#endif
}

}  // namespace

struct HostPart::State {
  std::mutex mutex;
  format_detail::WideNodes nodes;
  HostScene scene;
  bool tried = false;

  void prepare(const BufferView& file, const WideTracer& tracer) {
    if (tried && scene.checksum == file.header->checksum) return;
    tried = true;
    scene = {nullptr, file.header->checksum, tracer.closest_hit, tracer.any_hit, tracer.closest_hits, tracer.any_hits};
    nodes = {};
    try {
      nodes = format_detail::make_wide_nodes(file);
    } catch (const std::bad_alloc&) {
      return;
    }
    if (!nodes.empty()) scene.nodes = nodes.data();
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
  const WideTracer* tracer = wide_tracer();
  if (tracer == nullptr) return view;
  const std::lock_guard lock(state_->mutex);
  state_->prepare(file, *tracer);
  if (state_->scene.nodes != nullptr) view.host = &state_->scene;
  return view;
}

}  // namespace hiprt
