#pragma once
/// Values of glTF accessors, range-checked.

#include <tools/scene_io/transform.h>

#include <hiprt_build/error.h>
#include <hiprt_build/input.h>

#include <cstdint>
#include <vector>

namespace tinygltf {
class Model;
}

namespace hiprt::tools {

/// Reads accessor @p index as positions (VEC3 of any component type; normalised integers become fractions), with its
/// sparse substitutions. Zeros without a bufferView. @return kInvalidInput with the accessor's number if anything of it
/// leaves its buffer.
build::Result<std::vector<build::Position>> read_positions(const tinygltf::Model& model, int index);

/// Reads accessor @p index as numbers, or vectors of 2 to 4 components, which follow each other in the result.
build::Result<std::vector<double>> read_vectors(const tinygltf::Model& model, int index, unsigned components);

/// Reads accessor @p index as matrices (MAT4 of floats, column by column) whose last row is 0, 0, 0, 1. @return the
/// other rows.
build::Result<std::vector<Transform>> read_matrices(const tinygltf::Model& model, int index);

/// Reads accessor @p index as vertex numbers (SCALAR of an unsigned type).
build::Result<std::vector<std::uint32_t>> read_indices(const tinygltf::Model& model, int index);

}  // namespace hiprt::tools
