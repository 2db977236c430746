#pragma once
/// BVH files as the tools open them.

#include <hiprt_build/buffer.h>
#include <hiprt_build/error.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/format/view.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace hiprt::tools {

/// A mapped file and the view of it.
struct BvhFile {
  build::Buffer buffer;
  BufferView view;
};

/// Checks header and section table only: the content must not be walked.
/// @return kIo, or kInvalidInput with the path and the FormatIssue's text.
build::Result<BvhFile> open_bvh(const std::filesystem::path& path);

/// hiprt::validate(). @param threads 0: as many as the machine has.
tl::expected<ValidateSummary, FormatIssue> validate_on(unsigned threads, std::span<const std::byte> bytes);

/// Checks everything: the file may be traversed. @param threads 0: as many as the machine has.
build::Result<BvhFile> load_bvh(const std::filesystem::path& path, unsigned threads = 0);

/// Whether trace() can trace a file. @return kInvalidInput: it has custom primitives, or some object has, that are no
/// shapes (spheres and curves, which the file holds); kTooLarge with the path, the levels of instances or stack entries
/// needed, and the limit (trace_limits.h).
build::Result<void> check_traceable(const std::filesystem::path& path, const BufferView& view);

/// "scene.bvh: not a valid BVH file: BadMagic at byte 0: ..."
build::Error format_error(const std::filesystem::path& path, const FormatIssue& issue);

}  // namespace hiprt::tools
