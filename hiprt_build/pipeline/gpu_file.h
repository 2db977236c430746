#pragma once
/// What a file that was made on a device still lacks. Internal.

#include <hiprt_build/gpu/instances.h>

#include <span>
#include <string_view>

namespace hiprt::build {

/// Appends the provenance and writes the checksum.
/// @param bytes of BuiltScene::buffer.
Buffer complete_file(std::span<const std::byte> bytes, const gpu::BuildReport& report, std::string_view tool);

/// @return the provenance of a scene of instances.
std::string instance_provenance(const gpu::InstanceReport& report, std::string_view tool);

}  // namespace hiprt::build
