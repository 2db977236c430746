#include "bvh_file.h"

#include "trace_limits.h"

#include <hiprt_build/file.h>

#include <utility>

namespace hiprt::tools {

build::Error format_error(const std::filesystem::path& path, const FormatIssue& issue) {
  return {build::ErrorCode::kInvalidInput, path.string() + ": not a valid BVH file: " + to_string(issue)};
}

build::Result<BvhFile> open_bvh(const std::filesystem::path& path) {
  auto buffer = build::map_file(path);
  if (!buffer) return tl::unexpected(buffer.error());
  const auto view = open_buffer(std::as_const(*buffer).bytes());
  if (!view) return tl::unexpected(format_error(path, view.error()));
  return BvhFile{std::move(*buffer), *view};
}

build::Result<BvhFile> load_bvh(const std::filesystem::path& path) {
  auto file = open_bvh(path);
  if (!file) return file;
  if (const auto valid = validate(file->view.bytes); !valid) return tl::unexpected(format_error(path, valid.error()));
  return file;
}

build::Result<void> check_traceable(const std::filesystem::path& path, const FileHeader& header) {
  if (header.features & feature_bit(Feature::kCustom))
    return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput,
                                       path.string() + ": has custom primitives, which need functors of a program of "
                                                       "yours: the tools trace triangles only"});
  const auto too_large = [&](std::uint32_t number, const char* what, unsigned limit) {
    return tl::unexpected(
        build::Error{build::ErrorCode::kTooLarge,
                     path.string() + ": " + std::to_string(number) + what + ", the limit is " + std::to_string(limit)});
  };
  if (header.levels > kTraceLevels) return too_large(header.levels, " levels of instances", kTraceLevels);
  if (header.stack_bound > kTraceStack) return too_large(header.stack_bound, " stack entries needed", kTraceStack);
  return {};
}

}  // namespace hiprt::tools
