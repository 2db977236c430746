#pragma once
/// Opens and checks BVH files.

#include <hiprt_build/buffer.h>
#include <hiprt_build/error.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/format/view.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace hiprt::tools {

/// The bytes of a file and the view of them.
struct BvhFile {
  build::Buffer buffer;
  BufferView view;
};

/// The file that a buffer holds. @param path for messages. @return the buffer's error, or as open_bvh().
build::Result<BvhFile> open_bytes(const std::filesystem::path& path, build::Result<build::Buffer> buffer);

/// Checks header and section table only. The content is not checked: it must not be traversed.
/// @param max_memory bytes that the file may take (MemoryLimit). @pre no other limit lives
/// @param threads that read it; 0: as many as the machine has.
/// @return kIo, kOutOfMemory, or kInvalidInput with the path and the FormatIssue's text.
build::Result<BvhFile> open_bvh(const std::filesystem::path& path, std::uint64_t max_memory, unsigned threads = 0);

/// hiprt::validate(). @param threads 0: as many as the machine has.
tl::expected<ValidateSummary, FormatIssue> validate_on(unsigned threads, std::span<const std::byte> bytes);

/// As open_bvh(), and checks the whole file, so that it may be traversed.
build::Result<BvhFile> load_bvh(const std::filesystem::path& path, std::uint64_t max_memory, unsigned threads = 0);

/// The same for a mapped file, whose pages other processes of the machine share. It must not change.
build::Result<BvhFile> map_bvh(const std::filesystem::path& path, unsigned threads = 0);

/// Whether trace() can trace a file.
/// @return kInvalidInput if it or one of its objects has custom primitives other than spheres and curves. kTooLarge if
/// it has more levels of instances or needs more stack entries than trace_limits.h allows.
build::Result<void> check_traceable(const std::filesystem::path& path, const BufferView& view);

/// Whether insides and overlaps can be asked of a file.
/// @return kInvalidInput if it or one of its objects has custom primitives, spheres or curves.
build::Result<void> check_triangles_only(const std::filesystem::path& path, const BufferView& view);

/// "scene.bvh: not a valid BVH file: BadMagic at byte 0: ..."
build::Error format_error(const std::filesystem::path& path, const FormatIssue& issue);

}  // namespace hiprt::tools
