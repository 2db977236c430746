#pragma once
/// The compiled shaders (SPIR-V).

#include <cstdint>
#include <span>

namespace hiprt::bench::vulkan {

/// The shaders of one kind of query.
struct Shaders {
  std::span<const std::uint32_t> raygen, miss, closest_hit;  ///< Of the pipeline. closest_hit: empty for any hit.
  std::span<const std::uint32_t> compute;                    ///< With a ray query.
};

Shaders shaders(bool any_hit);

}  // namespace hiprt::bench::vulkan
