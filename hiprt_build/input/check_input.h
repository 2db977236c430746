#pragma once
/// What every operation on a scene's primitives asks of them, and how messages name them. Internal.

#include <hiprt_build/error.h>
#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/input/build_input.h>
#include <hiprt_build/pair/pair.h>

#include <sstream>
#include <string>

namespace hiprt::build {

inline Error invalid(std::string message) { return Error{ErrorCode::kInvalidInput, std::move(message)}; }

/// A number in messages: short, and exact enough to recognise.
inline std::string text(double number) {
  std::ostringstream out;
  out << number;
  return out.str();
}

/// "mesh 3 (chair.obj)" or "custom geometry 0 (hair)"
std::string describe(const BuildInput& input, std::size_t geometry);

/// "mesh 3 (chair.obj), triangle 17: " or "custom geometry 0 (hair), primitive 4: "
std::string describe(const BuildInput& input, std::size_t geometry, std::size_t primitive);

/// Geometries, vertices and primitives within what a file and the builders' numbers can address. Reads no array.
Result<void> check_sizes(const SceneInput& scene);

/// Finds the first index past the vertices.
Result<void> check_indices(CpuEngine& engine, const BuildInput& input);

/// Of geometries with shapes: as many as boxes, good ones (shape_boxes()), and each inside its box.
Result<void> check_shapes(CpuEngine& engine, const BuildInput& input);

/// Finds the first coordinate that a quantized node cannot hold.
Result<void> check_quantizable(CpuEngine& engine, const BuildInput& input, const PairedPrimitives& paired);

}  // namespace hiprt::build
