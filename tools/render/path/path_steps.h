#pragma once
/// The steps of a wave of paths on the CPU. They are compiled once per instruction set (path_kernels.cpp).

#include <tools/render/path/path_stages.h>

namespace hiprt::tools {

/// The surfaces that others have told.
struct ToldSurfaces {
  const PathSurface* surfaces = nullptr;  ///< Of hit 0, of hit 1, ...

  PathSurface at(std::uint32_t i, const PathScene&, const Ray&, const Hit&, const InstancePath<kTraceLevels>&) const {
    return surfaces[i];
  }
};

/// Does a step for all elements below @p count, one after the other, by the variant for this machine. All variants give
/// the same bits.
/// @param told surfaces of the hits, for PathStage::kShade. nullptr: those of the job's scene.
void run_step(PathStage stage, const PathJob& job, std::uint32_t count, const PathSurface* told = nullptr);

}  // namespace hiprt::tools
