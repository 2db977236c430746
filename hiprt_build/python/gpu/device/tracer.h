#pragma once
/// The policies of the module's tracers, and what its loops on CPUs and its kernels on GPUs share.

#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/primitives/scene_shapes.h>

namespace hiprt::python {
inline namespace HIPRT_ISA_NAMESPACE {

/// @tparam kEntries of the stack, with kMostPushed.
template <class LayoutType, unsigned kEntries, class TriangleType = Watertight, class BoxesType = Conservative>
struct TracerPolicies : Policies {
  using Layout = LayoutType;
  using Triangle = TriangleType;
  using Boxes = BoxesType;
  using Stack = PrivateStack<kEntries>;
};

/// Lists and counts of hits have no normals.
template <class Base> struct WithoutSurface : Base { static constexpr bool kSurface = false; };

template <class Primitives> HIPRT_HD inline Primitives make_primitives(const SceneView& scene) {
  if constexpr (std::is_same_v<Primitives, SceneShapes>)
    return SceneShapes(scene);
  else
    return {};
}

/// @param to array of @p levels numbers.
template <class P, class AnyResult>
HIPRT_HD inline void store_path(const AnyResult& found, std::uint32_t* to, std::uint32_t levels) {
  if constexpr (P::kLevels != 0) {
    const std::uint32_t depth = found.found() ? found.path.depth : 0;
    for (std::uint32_t k = 0; k < levels; ++k) to[k] = k < depth ? found.path.instance[k] : kInvalidId;
  }
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::python
