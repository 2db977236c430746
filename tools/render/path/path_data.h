#pragma once
/// The arrays of a path tracer's scene on the host.

#include <tools/render/path/path_sky.h>
#include <tools/render/scene/path_scene.h>
#include <tools/scene_io/surface/surface.h>

#include <hiprt_build/error.h>
#include <hiprt_build/format/view.h>

#include <vector>

namespace hiprt::tools {

template <class T> using PathVector = std::vector<T>;
using PathData = PathArrays<PathVector>;

/// @param surfaces nullptr: everything is clay (Studio::clay()), without texture and emission.
/// @param middle of the shutter's interval. Lights are chosen by the light that they emit at that time.
/// @return kTooLarge if the textures or the triangles that emit are more than the arrays hold.
build::Result<PathData> make_path_data(const BufferView& scene, const SceneSurfaces* surfaces, PathSky sky,
                                       std::vector<Vec3> backdrop, float middle);

/// Views of the host's arrays.
PathArrays<PathView> views(const PathData& data);

/// Whether a material cuts out parts of triangles, so that rays need the filter AlphaCutout.
bool has_alpha_cutout(const PathData& data);

}  // namespace hiprt::tools
