#pragma once
/// Whether meshes and custom primitives can be built, beyond what single options say. Internal.

#include <hiprt_build/error.h>
#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/steps/pair.h>

#include <string>

namespace hiprt::build {

/// Geometries, vertices and primitives within what a file and the builders' numbers can address. Reads no array.
Result<void> check_sizes(const SceneInput& scene);

/// @return the first index past the vertices.
Result<void> check_indices(CpuEngine& engine, const PrimitiveSoup& soup);

/// @return the first coordinate that a quantized node cannot hold.
Result<void> check_quantizable(CpuEngine& engine, const PrimitiveSoup& soup, const GroupedPrimitives& grouped);

/// "mesh 3 (chair.obj), triangle 17: " or "custom geometry 0 (hair), primitive 4: "
std::string place_of(const PrimitiveSoup& soup, PrimitivePlace place);

}  // namespace hiprt::build
