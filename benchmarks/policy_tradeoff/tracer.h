#pragma once
/// Traces float rays by a policy set. kInstanced: the scene has instances, which may move.

#include <hiprt_device/hiprt_device.h>
#include <tests/oracle/probe.h>

#include <type_traits>

namespace hiprt::bench {

/// Most levels of instances of the scenes (instanced_scenes.h).
inline constexpr unsigned kInstanceLevels = 16;

inline namespace HIPRT_ISA_NAMESPACE {

template <class LayoutType, class TriangleTest, class BoxTest, bool kInstanced = false> struct Tracer {
  const SceneView* scene;

  HIPRT_HD Hit closest(const Ray& ray) const { return trace<BoxTest>(ray); }
  /// Without instances only: CheckKind::kBoxes does not use them, and kernels take long to compile.
  HIPRT_HD Hit every_box(const Ray& ray) const requires(!kInstanced) { return trace<oracle::EveryBox>(ray); }

 private:
  template <class TriangleType, class BoxesType> struct Chosen : WithLayout<LayoutType> {
    using Triangle = TriangleType;
    using Boxes = BoxesType;
  };

  template <class Test> HIPRT_HD Hit trace(const Ray& ray) const {
    if constexpr (std::is_same_v<TriangleTest, WatertightDouble>)
      return rounded(
          closest_hit<typename Put<DoubleRays<Chosen<Watertight, Test>>>::Type>(*scene, convert<double>(ray)));
    else
      return closest_hit<typename Put<Chosen<TriangleTest, Test>>::Type>(*scene, ray);
  }

  template <class P> struct Put {
    using Type = std::conditional_t<kInstanced, Moving<Instanced<P, kInstanceLevels>>, P>;
  };

  HIPRT_HD static Hit rounded(const HitD& hit) {
    // Float hits have the same error bound in units of 2^-24 instead of 2^-53.
    return {
        static_cast<float>(hit.t), static_cast<float>(hit.u), static_cast<float>(hit.v), hit.geometry, hit.primitive,
        Vec3(hit.normal),          0x1p29f * hit.error};
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::bench
