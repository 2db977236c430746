#include <tests/gpu/traversal_kernels.h>

namespace hiprt::checks {

namespace {

template <class Layout, class StackMemory, class Schedule, Query kQuery, class Filter = NoFilter,
          class Primitives = NoPrimitives>
Variant mix_of(const char* name) {
  return variant<With<Layout, StackMemory, Schedule>, StackMemory, kQuery, Filter, Primitives>(name);
}

}  // namespace

std::span<const Variant> mixed_variants() {
  static const Variant variants[] = {
      mix_of<FloatLayout, RollingInGrid<8>, Postponed, Query::kAny, RejectSome>(
          "float, rolling, postponed, any, reject"),
      mix_of<HalfLayout, Restarting<4>, WholeWave<16>, Query::kClosest>("half, restart, whole wave, closest"),
      mix_of<QuantizedLayout, GlobalInSlot, Postponed, Query::kAll>("quantized, global, postponed, all"),
      mix_of<QuantizedLayout, InShared<48>, WholeWave<24>, Query::kAny, StopAtOnce>(
          "quantized, shared, whole wave, any, stop"),
      mix_of<PlanesLayout, InPrivate<64>, Immediate, Query::kAll, StopAtOnce>("planes, private, immediate, all, stop"),
      mix_of<HalfLayout, RollingInSlot<4>, Immediate, Query::kClosest, RejectSome>(
          "half, rolling in a slot, immediate, closest, reject"),
      mix_of<FloatLayout, InShared<48>, WholeWave<32>, Query::kClosest, StopAtOnce>(
          "float, shared, whole wave, closest, stop"),
  };
  return variants;
}

std::span<const Variant> custom_variants() {
  static const Variant variants[] = {
      mix_of<PlanesLayout, InPrivate<64>, Immediate, Query::kClosest, NoFilter, Customs>("planes, private, closest"),
      mix_of<FloatLayout, RollingInGrid<8>, Immediate, Query::kAny, NoFilter, Customs>("float, rolling, any"),
      mix_of<HalfLayout, InPrivate<64>, Postponed, Query::kAll, RejectSome, Customs>(
          "half, private, postponed, all, reject"),
      mix_of<QuantizedLayout, Restarting<4>, WholeWave<16>, Query::kClosest, RejectSome, Customs>(
          "quantized, restart, whole wave, closest, reject"),
  };
  return variants;
}

}  // namespace hiprt::checks
