#include <tests/gpu/traversal_kernels.h>

namespace hiprt::checks {

namespace {

using Default = InPrivate<64>;
using Planes = With<PlanesLayout, Default>;
template <class Schedule> using Scheduled = With<PlanesLayout, Default, Schedule>;

}  // namespace

std::span<const Variant> schedule_variants() {
  static const Variant variants[] = {
      variant<Scheduled<Immediate>, Default>("immediate"),
      variant<Scheduled<Postponed>, Default>("postponed"),
      variant<Scheduled<WholeWave<16>>, Default>("whole wave"),
      variant<Scheduled<WholeWave<1>>, Default, Query::kAny>("whole wave to the end, any"),
  };
  return variants;
}

std::span<const Variant> query_variants() {
  static const Variant variants[] = {
      variant<Planes, Default, Query::kClosest>("closest"),
      variant<Planes, Default, Query::kAny>("any"),
      variant<Planes, Default, Query::kAll>("all"),
  };
  return variants;
}

std::span<const Variant> filter_variants() {
  static const Variant variants[] = {
      variant<Planes, Default, Query::kClosest, AcceptAll>("accept"),
      variant<Planes, Default, Query::kClosest, RejectSome>("reject"),
      variant<Planes, Default, Query::kClosest, StopAtOnce>("stop"),
      variant<Planes, Default, Query::kAny, RejectSome>("reject, any"),
      variant<Planes, Default, Query::kAny, StopAtOnce>("stop, any"),
      variant<Planes, Default, Query::kAll, RejectSome>("reject, all"),
  };
  return variants;
}

}  // namespace hiprt::checks
