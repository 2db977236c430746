#pragma once
/// Reads input files.

#include <hiprt_build/buffer.h>
#include <hiprt_build/error.h>

#include <filesystem>

namespace hiprt::tools {

/// As build::read_file(); an error of memory names --max-memory. The tools read files and do not map them, because a
/// mapping changes with its file. Checked bytes could become others. Those of a shortened file raise SIGBUS.
/// @param threads that read large files; 0: as many as the machine has.
build::Result<build::Buffer> read_input(const std::filesystem::path& path, unsigned threads = 1);

}  // namespace hiprt::tools
