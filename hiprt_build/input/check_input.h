#pragma once
/// Checks of a scene's primitives, and their names in messages. Internal.

#include <hiprt_build/error.h>
#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/input/build_input.h>
#include <hiprt_build/pair/pair.h>

#include <sstream>
#include <string>

namespace hiprt::build {

inline Error invalid(std::string message) { return Error{ErrorCode::kInvalidInput, std::move(message)}; }

/// @return a number for messages: short, and exact enough to recognise.
inline std::string text(double number) {
  std::ostringstream out;
  out << number;
  return out.str();
}

/// "mesh 3 (chair.obj)" or "custom geometry 0 (hair)"
std::string describe(const BuildInput& input, std::size_t geometry);

/// "mesh 3 (chair.obj), triangle 17: " or "custom geometry 0 (hair), primitive 4: "
std::string describe(const BuildInput& input, std::size_t geometry, std::size_t primitive);

/// Checks the numbers of geometries, vertices and primitives, and strides and types, against the limits of files and
/// builders. Reads no array.
Result<void> check_sizes(const SceneInput& scene);

/// Refuses indices past the vertices and names the first.
Result<void> check_indices(CpuEngine& engine, const BuildInput& input);

/// Refuses pairs of triangles that do not exist, and triangles in two pairs.
Result<void> check_pairs(CpuEngine& engine, const BuildInput& input);

/// Checks shapes: as many as boxes, valid ones (shape_boxes()), and each inside its box.
Result<void> check_shapes(CpuEngine& engine, const BuildInput& input);

/// Refuses coordinates that a quantized node cannot hold and names the first.
Result<void> check_quantizable(CpuEngine& engine, const BuildInput& input, const PairedPrimitives& paired);

}  // namespace hiprt::build
