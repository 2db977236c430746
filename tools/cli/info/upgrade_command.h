#pragma once
/// bvhinfo --upgrade: writes a BVH file of an older version as one of this version.

#include <hiprt_build/error.h>

#include <cstdint>
#include <string>

namespace hiprt::tools {

class Cli;

/// Writes @p input to @p output with the newest version in its header and in those of its objects. All other bytes but
/// the checksums stay. A file that has the newest version already is copied, and the tool says so.
/// @return the errors of load_bvh(), check_output() and build::write_file(). kInvalidInput if the file, or an object in
/// it, has a newer version than this program. kOutOfMemory.
/// @param max_memory bytes that reading the input may take.
build::Result<void> run_upgrade(const Cli& cli, const std::string& input, const std::string& output,
                                std::uint64_t max_memory);

}  // namespace hiprt::tools
