#include <tests/gpu/traversal_kernels.h>

namespace hiprt::checks {

namespace {

template <class StackMemory, Query kQuery = Query::kClosest> Variant with(const char* name) {
  return variant<With<PlanesLayout, StackMemory>, StackMemory, kQuery>(name);
}

template <class StackMemory, Query kQuery = Query::kClosest> Variant in_batch(const char* name) {
  return variant<With<PlanesLayout, StackMemory, WholeWave<16>>, StackMemory, kQuery>(name);
}

}  // namespace

std::span<const Variant> stack_variants() {
  static const Variant variants[] = {
      with<InPrivate<64>>("private"),
      with<InShared<48>>("shared"),
      with<InTiers<4, 64>>("tiered"),
      with<InTiers<2, 64>, Query::kAny>("tiered, two shared, any"),
      with<RollingInGrid<8>>("rolling, grid"),
      with<RollingInGrid<2>, Query::kAny>("small ring, grid, any"),
      with<RollingInSlot<8>>("rolling, slot of a pool"),
      with<GlobalInSlot>("global, slot of a pool"),
      with<GlobalInSlot, Query::kAny>("global, slot of a pool, any"),
      with<Restarting<0>>("restart, nothing held"),
      with<Restarting<4>>("restart"),
      with<Restarting<2>, Query::kAny>("restart, any"),
  };
  return variants;
}

std::span<const Variant> tiny_stack_variants() {
  static const Variant variants[] = {
      with<InPrivate<5>>("private"),
      in_batch<InPrivate<5>>("private, batch"),
      with<InShared<5>>("shared"),
      in_batch<InShared<5>, Query::kAny>("shared, batch, any"),
      with<InTiers<2, 5>>("tiered"),
      in_batch<InTiers<2, 5>, Query::kAny>("tiered, batch, any"),
      with<RollingInGrid<4>>("rolling, grid"),
      with<RollingInSlot<4>>("rolling, slot of a pool"),
      with<GlobalInSlot>("global, slot of a pool"),
      with<GlobalInSlot, Query::kAny>("global, slot of a pool, any"),
  };
  return variants;
}

std::span<const Variant> restart_variants() {
  static const Variant variants[] = {with<Restarting<4>>("restart"), with<Restarting<2>, Query::kAny>("restart, any")};
  return variants;
}

}  // namespace hiprt::checks
