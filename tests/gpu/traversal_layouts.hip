#include <tests/gpu/traversal_kernels.h>

namespace hiprt::checks {

namespace {

using Default = InPrivate<192>;

/// The calls without policies, which choose by the scene's layout.
template <Query kQuery> __global__ void call_default(Job job) {
  const std::uint32_t i = blockIdx.x * kBlock + threadIdx.x;
  if (i >= job.count) return;
  const Hit hit = kQuery == Query::kClosest ? closest_hit(job.scene, job.rays[i]) : any_hit(job.scene, job.rays[i]);
  const TraversalState state = hit.found() ? TraversalState::kHit : TraversalState::kFinished;
  job.results[i] = {hit, state, hit.failed(), hit.found(), hit.found() ? digest_of(hit) : 0};
}

template <Query kQuery> Variant default_call(const char* name, NodeLayout layout) {
  return {name, &call_default<kQuery>, layout, kQuery, Filtering::kNone, 1, false, false};
}

}  // namespace

std::span<const Variant> layout_variants() {
  static const Variant variants[] = {
      variant<With<FloatLayout, Default>, Default>("float"),
      variant<With<PlanesLayout, Default>, Default>("planes"),
      variant<With<HalfLayout, Default>, Default>("half"),
      variant<With<QuantizedLayout, Default>, Default>("quantized"),
      variant<With<HalfLayout, Default>, Default, Query::kAny>("half, any"),
      variant<With<QuantizedLayout, Default>, Default, Query::kAny>("quantized, any"),
  };
  return variants;
}

std::span<const Variant> default_call_variants() {
  static const Variant variants[] = {
      default_call<Query::kClosest>("closest_hit(float)", NodeLayout::kFloat),
      default_call<Query::kClosest>("closest_hit(planes)", NodeLayout::kPlanes),
      default_call<Query::kClosest>("closest_hit(half)", NodeLayout::kHalf),
      default_call<Query::kClosest>("closest_hit(quantized)", NodeLayout::kQuantized),
      default_call<Query::kAny>("any_hit(float)", NodeLayout::kFloat),
      default_call<Query::kAny>("any_hit(planes)", NodeLayout::kPlanes),
      default_call<Query::kAny>("any_hit(half)", NodeLayout::kHalf),
      default_call<Query::kAny>("any_hit(quantized)", NodeLayout::kQuantized),
  };
  return variants;
}

}  // namespace hiprt::checks
