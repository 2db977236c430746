#pragma once
/// Divides the instances of a scene into parts of equal memory, near each other in space.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hiprt::tools {

/// What a division depends on.
struct SplitInput {
  struct Instance {
    std::array<double, 3> center;  ///< Of its box in the scene.
    std::uint32_t object;          ///< Index in `needs`.
  };
  std::vector<Instance> instances;
  std::vector<std::vector<std::uint32_t>> needs;  ///< Files that each object needs, itself or below its instances.
  std::vector<std::uint64_t> file_bytes;          ///< Memory of each file. A part has a file once.
  std::uint64_t instance_bytes = 0;               ///< Memory of an instance.
};

/// Cuts the instances in two at a plane, and the halves again. Planes across the three axes are tried. The one with the
/// least memory of the larger side is taken, in proportion to the parts that the side becomes. A plane across the
/// longest axis may be 5 % worse.
/// @param parts from 1 to the number of instances.
/// @return the instances of each part, in ascending order; none is empty. Parts with neighbouring numbers are near each
/// other.
std::vector<std::vector<std::uint32_t>> split_scene(const SplitInput& input, std::size_t parts);

/// Memory of some instances with the files that they need.
std::uint64_t bytes_of(const SplitInput& input, std::span<const std::uint32_t> instances);

}  // namespace hiprt::tools
