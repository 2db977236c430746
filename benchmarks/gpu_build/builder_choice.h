#pragma once
/// Builders and their options as words of a command line.

#include <hiprt_build/gpu/build.h>

#include <string>

namespace hiprt::bench {

/// "sbvh:split=3:rounds=8"
/// @return kInvalidInput that names the part that is wrong.
build::Result<gpu::BuildOptions> parse_builder(const std::string& text);

/// Such a text as part of a file's name: "sbvh_split3_rounds8".
std::string file_name(std::string builder);

}  // namespace hiprt::bench
