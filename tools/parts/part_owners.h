#pragma once
/// Which process has which part of a scene.

#include <tools/parts/part_manifest.h>

#include <span>
#include <vector>

namespace hiprt::tools {

/// Gives each process parts with neighbouring numbers, so that the largest memory of a process is as small as it can be
/// then. With fewer parts than processes some get none.
/// @return the process of each part.
std::vector<unsigned> owners_of(std::span<const ScenePart> parts, unsigned processes);

}  // namespace hiprt::tools
