#pragma once
/// The check of an output path before long work begins.

#include <hiprt_build/error.h>

#include <span>
#include <string>

namespace hiprt::tools {

/// Checks that @p output can be written and is none of @p inputs.
/// @return kIo or kInvalidInput with the path and the reason.
build::Result<void> check_output(const std::string& output, std::span<const std::string> inputs);

}  // namespace hiprt::tools
