#pragma once
/// Builders and their options on the command line.

#include <hiprt_build/gpu/build.h>

#include <string>

namespace hiprt::bench {

/// Parses "sbvh:split=3:rounds=8".
/// @return kInvalidInput that names the part that is wrong.
build::Result<gpu::BuildOptions> parse_builder(const std::string& text);

/// The text as part of a file name: "sbvh_split3_rounds8".
std::string file_name(std::string builder);

}  // namespace hiprt::bench
