#include <tests/traversal/boxes/box_tests.h>

#include <hiprt_device/format/layout.h>
#include <hiprt_device/intersect/box_test.h>

namespace hiprt::checks {

namespace {

template <class Layout> bool round(NodeBoxes& boxes) {
  typename Layout::Node node{};
  if (!Layout::set_boxes(node, boxes.child)) return false;
  for (unsigned i = 0; i < kBranching; ++i) boxes.child[i] = Layout::box(node, i);
  return true;
}

template <class Layout, class Lanes, class Policy>
std::uint32_t passing(const Ray& ray, const NodeBoxes& boxes, const Box& bounds) {
  typename Layout::Node node{};
  Layout::set_boxes(node, boxes.child);
  const float tmin = ray.tmin < 0.0f ? 0.0f : ray.tmin, start = Lanes::kComparesBits ? tmin : 0.0f;
  const RaySlabs<Lanes> slabs(ray, Policy::margin(ray.origin, bounds), start);
  const BoxHits<Lanes> hits =
      intersect_boxes<Lanes>(node, slabs, Lanes::uniform(tmin - start), Lanes::uniform(ray.tmax - start));
  std::uint32_t mask = 0;
  for (unsigned i = 0; i < kBranching; ++i) mask |= (hits.hit(i) ? 1u : 0u) << i;
  return mask;
}

template <class Layout, class Lanes, class Policy> constexpr NamedBoxTest test(const char* name) {
  return {name, std::is_same_v<Policy, Conservative>, round<Layout>, passing<Layout, Lanes, Policy>};
}

constexpr NamedBoxTest kTests[] = {
    test<PlanesLayout, ArrayLanes, Conservative>("conservative planes array"),
    test<FloatLayout, ArrayLanes, Conservative>("conservative float array"),
    test<HalfLayout, ArrayLanes, Conservative>("conservative half array"),
    test<QuantizedLayout, ArrayLanes, Conservative>("conservative quantized array"),
    test<PlanesLayout, BitLanes, Conservative>("conservative planes bits"),
    test<QuantizedLayout, BitLanes, Conservative>("conservative quantized bits"),
    test<PlanesLayout, DefaultLanes, Conservative>("conservative planes simd"),
    test<FloatLayout, DefaultLanes, Conservative>("conservative float simd"),
    test<HalfLayout, DefaultLanes, Conservative>("conservative half simd"),
    test<QuantizedLayout, DefaultLanes, Conservative>("conservative quantized simd"),
    test<PlanesLayout, ArrayLanes, Plain>("plain planes array"),
    test<PlanesLayout, DefaultLanes, Plain>("plain planes simd"),
    test<HalfLayout, DefaultLanes, Plain>("plain half simd"),
    test<QuantizedLayout, DefaultLanes, Plain>("plain quantized simd"),
};

}  // namespace

std::span<const NamedBoxTest> box_tests() { return kTests; }

}  // namespace hiprt::checks
