#pragma once
/// Traces many rays on the host, with the default policies. Needs the library hiprt::format only.
///
///     std::vector<hiprt::Hit> hits(rays.size());
///     hiprt::closest_hits(file->scene(), rays, hits);

#include <hiprt_build/error.h>
#include <hiprt_build/export.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>

#include <span>

namespace hiprt {

/// hits[i] becomes closest_hit(scene, rays[i]), with the same bits.
///
/// Where the view has a HostScene, windows of eight rays that are nearly parallel and close to each other are traced at
/// once. In scenes that do not fit into a cache eight other rays are traced in turn: while memory is read for one ray,
/// others are tested. So neighbours in @p rays should be neighbours in the scene.
/// @param loop may share blocks of rays among threads, see validate(). Empty: this thread.
/// @return kInvalidInput if there are more rays than hits.
HIPRT_BUILD_API build::Result<void> closest_hits(const SceneView& scene, std::span<const Ray> rays, std::span<Hit> hits,
                                                 const ParallelLoop& loop = {});

/// The same with any_hit(scene, rays[i]). Which hit it is depends on the tree, and on the machine.
HIPRT_BUILD_API build::Result<void> any_hits(const SceneView& scene, std::span<const Ray> rays, std::span<Hit> hits,
                                             const ParallelLoop& loop = {});

}  // namespace hiprt
