#pragma once
/// BVH files on disk.

#include <hiprt_build/buffer.h>
#include <hiprt_build/error.h>
#include <hiprt_build/format/parallel_loop.h>

#include <filesystem>
#include <span>

namespace hiprt::build {

/// Maps a file read-only. The content is not checked: call hiprt::validate() on files of unknown origin. The file must
/// not change while it is mapped: the bytes change with it, and where it has been shortened reads raise SIGBUS. Take
/// read_file() for files that other programs may write to.
/// @return kIo with the path and the system's reason (missing, unreadable, a directory, empty).
HIPRT_BUILD_API Result<Buffer> map_file(const std::filesystem::path& path);

/// Reads a whole file into memory. What other programs do to the file later has no effect on the bytes.
/// @param loop may read parts of 16 MiB on many threads. Empty: this thread.
/// @return the errors of map_file(); kIo with the path if another program shortened or changed the file at the same
/// time; kOutOfMemory.
HIPRT_BUILD_API Result<Buffer> read_file(const std::filesystem::path& path, const ParallelLoop& loop = {});

/// Whether write_file() could write there, as far as that can be known. Call it before long work.
/// @return kIo with the path and the reason (no such folder, a folder, not a regular file, no permission).
HIPRT_BUILD_API Result<void> check_writable(const std::filesystem::path& path);

/// Writes to a temporary file in the same folder, flushes it and renames it. So there is either the old file or the
/// whole new one. A file without write permission is not replaced.
/// @return the errors of check_writable(), or kIo with the system's reason.
HIPRT_BUILD_API Result<void> write_file(const std::filesystem::path& path, std::span<const std::byte> bytes);

}  // namespace hiprt::build
