#pragma once
/// An observer that counts a ray's work and reports every step of the traversal.

#include <tools/render/tracers/tracer.h>

#include <hiprt_device/hiprt_device.h>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

/// Reports to a sink if there is one. For tracers whose speed does not matter.
struct StepCounter : WorkCounter {
  StepSink sink;

  void on_node(const NodeVisit& visit) const { tell({TraceStep::Kind::kNode, visit, 0, 0}); }
  void on_leaf_at(const std::byte* base, NodeRef leaf) const {
    tell({TraceStep::Kind::kLeaf, {base, leaf, {}, {}}, 0, 0});
  }
  void on_candidate(unsigned slot, float t) const { tell({TraceStep::Kind::kCandidate, {}, slot, t}); }
  void on_enter(std::uint32_t instance) const { tell({TraceStep::Kind::kEnter, {}, instance, 0}); }
  void on_exit() const { tell({TraceStep::Kind::kExit, {}, 0, 0}); }

 private:
  void tell(const TraceStep& step) const {
    if (sink.take != nullptr) sink.take(sink.to, step);
  }
};
static_assert(TraversalObserver<StepCounter>);

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
