#pragma once
/// The steps of a build. Internal.

#include <hiprt_build/build.h>
#include <hiprt_build/exec/cpu.h>

namespace hiprt::build {

/// What build() does on an engine, whose monitor is asked instead of options.progress. Throws Cancelled and
/// std::bad_alloc.
/// @pre the options are in range, the builder is not kImported, and there are no more geometries and primitives than
/// can be numbered.
Result<Bvh> build_on(CpuEngine& engine, const SceneInput& scene, const BuildOptions& options);

}  // namespace hiprt::build
