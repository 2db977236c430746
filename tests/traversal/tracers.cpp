#include <tests/traversal/tracers.h>

#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_device/format/layout.h>
#include <hiprt_device/hiprt_device.h>

namespace hiprt::checks {

namespace {

template <class LayoutType, class TriangleType, class BoxesType, class LanesType> struct Chosen : Policies {
  using Layout = LayoutType;
  using Triangle = TriangleType;
  using Boxes = BoxesType;
  using Lanes = LanesType;
};

template <class Triangle, class Boxes, class Lanes> Hit closest(const Scene& scene, const Ray& ray) {
  return dispatch_layout(scene.traced.layout, [&](auto layout) {
    return closest_hit<Chosen<decltype(layout), Triangle, Boxes, Lanes>>(scene.traced, ray);
  });
}

template <class Triangle, class Boxes, class Lanes> Hit any(const Scene& scene, const Ray& ray) {
  return dispatch_layout(scene.traced.layout, [&](auto layout) {
    return any_hit<Chosen<decltype(layout), Triangle, Boxes, Lanes>>(scene.traced, ray);
  });
}

// Of a scene with a HostScene these are the compiled tracers.
Hit closest_on_host(const Scene& scene, const Ray& ray) { return closest_hit(scene.traced, ray); }
Hit any_on_host(const Scene& scene, const Ray& ray) { return any_hit(scene.traced, ray); }

template <class Triangle, class Boxes, class Lanes>
constexpr Tracer tracer(const char* name, bool guaranteed, float weight_error = 0.0f) {
  return {name, guaranteed, closest<Triangle, Boxes, Lanes>, any<Triangle, Boxes, Lanes>, weight_error};
}

constexpr Tracer kTracers[] = {
    tracer<Watertight, Conservative, DefaultLanes>("watertight conservative", true),
    tracer<Watertight, Conservative, ArrayLanes>("the same, array lanes", true),
    tracer<Watertight, Conservative, BitLanes>("the same, by bits", true),
    {"the same, on the host", true, closest_on_host, any_on_host},
    tracer<Watertight, Plain, DefaultLanes>("watertight plain", false),
    tracer<Fast, Conservative, DefaultLanes>("fast conservative", false),
    tracer<Fast, Plain, DefaultLanes>("fast plain", false),
    tracer<Fast, Plain, ArrayLanes>("fast plain, array lanes", false),
    tracer<Reference, Conservative, DefaultLanes>("reference", true, 0x1p-23f),
    tracer<Reference, Conservative, ArrayLanes>("reference, array lanes", true, 0x1p-23f),
};

}  // namespace

std::span<const Tracer> all_tracers() { return kTracers; }
std::span<const Tracer> default_tracers() { return std::span(kTracers).first(4); }
std::uint32_t stack_capacity() { return 192; }

}  // namespace hiprt::checks
