/// The macros of AMD's HIPRT, defined before our headers: none of ours has such a name, and none is used. A program can
/// include both projects' headers.

#define HIPRT_API this is not ours
#define HIPRT_API_VERSION this is not ours
#define HIPRT_ASSERT this is not ours
#define HIPRT_CONST this is not ours
#define HIPRT_DEVICE this is not ours
#define HIPRT_EXPORTS this is not ours
#define HIPRT_HASH_VERSION this is not ours
#define HIPRT_HOST this is not ours
#define HIPRT_HOST_DEVICE this is not ours
#define HIPRT_INLINE this is not ours
#define HIPRT_LIB_NAME this is not ours
#define HIPRT_MAJOR_VERSION this is not ours
#define HIPRT_MINOR_VERSION this is not ours
#define HIPRT_PATCH_VERSION this is not ours
#define HIPRT_PATH this is not ours
#define HIPRT_PUBLIC_DEVICE_H this is not ours
#define HIPRT_ROOT_DIRECTORY this is not ours
#define HIPRT_RTIP this is not ours
#define HIPRT_STATIC_ASSERT this is not ours
#define HIPRT_STATIC_LIBRARY this is not ours
#define HIPRT_VERSION_STR this is not ours

#include <hiprt_build/build.h>
#include <hiprt_build/exchange.h>
#include <hiprt_build/file.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/merge_levels.h>
#include <hiprt_build/motion.h>
#include <hiprt_build/open_scene.h>
#include <hiprt_build/refit.h>
#include <hiprt_build/shapes.h>
#include <hiprt_build/statistics.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/primitives/double_triangle.h>
#include <hiprt_device/primitives/moving_triangle.h>
#include <hiprt_device/primitives/scene_shapes.h>

namespace hiprt {

/// A traversal, so that templates are compiled too.
Hit beside_hiprt(const SceneView& scene, const Ray& ray) { return closest_hit<Instanced<>>(scene, ray); }

}  // namespace hiprt
