#include <tests/traversal/box_tests.h>

#include <hiprt_device/box_test.h>
#include <hiprt_device/format/layout.h>

#include <limits>

namespace hiprt::checks {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr Box kEmpty{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};

template <class Layout, class Lanes, class Policy>
BoxAnswer keeps(const Ray& ray, const Box& box, unsigned child, const Box& bounds) {
  typename Layout::Node node{};
  for (unsigned i = 0; i < kBranching; ++i) Layout::set_box(node, i, i == child ? box : kEmpty);
  const RaySlabs<Lanes> slabs(ray, Policy::margin(ray.origin, bounds));
  const float tmin = ray.tmin < 0.0f ? 0.0f : ray.tmin;
  const BoxHits<Lanes> hits = intersect_boxes<Lanes>(node, slabs, Lanes::uniform(tmin), Lanes::uniform(ray.tmax));
  bool others = false;
  for (unsigned i = 0; i < kBranching; ++i) others = others || (i != child && hits.hit(i));
  return {hits.hit(child), others};
}

constexpr NamedBoxTest kTests[] = {
    {"conservative planes array", true, keeps<PlanesLayout, ArrayLanes, Conservative>},
    {"conservative float array", true, keeps<FloatLayout, ArrayLanes, Conservative>},
    {"conservative planes simd", true, keeps<PlanesLayout, DefaultLanes, Conservative>},
    {"conservative float simd", true, keeps<FloatLayout, DefaultLanes, Conservative>},
    {"plain planes array", false, keeps<PlanesLayout, ArrayLanes, Plain>},
    {"plain planes simd", false, keeps<PlanesLayout, DefaultLanes, Plain>},
};

}  // namespace

std::span<const NamedBoxTest> box_tests() { return kTests; }

}  // namespace hiprt::checks
