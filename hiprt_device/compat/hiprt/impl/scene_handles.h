#pragma once
/// Scenes of this library as HIPRT's handles, and back.

#include <hiprt/hiprt_types.h>
#include <hiprt_device/scene_view.h>

namespace hiprt {

/// A geometry for HIPRT's classes Geom...: triangles, or custom primitives, without instances.
/// @param view a SceneView in device memory. It must live as long as the handle is used.
HIPRT_HD inline hiprtGeometry geometry_handle(const SceneView* view) { return const_cast<SceneView*>(view); }
/// A scene for HIPRT's classes Scene... and for its transform queries.
HIPRT_HD inline hiprtScene scene_handle(const SceneView* view) { return const_cast<SceneView*>(view); }

namespace compat_detail {

/// The first bytes of what a hiprtGeometry or a hiprtScene points to.
HIPRT_HD inline const SceneView& view_of(const void* handle) { return *static_cast<const SceneView*>(handle); }

}  // namespace compat_detail
}  // namespace hiprt
