#include <hiprt_build/file.h>
#include <hiprt_build/open_scene.h>

#include <cstdint>
#include <cstring>
#include <new>
#include <utility>

namespace hiprt {

namespace {

build::Result<ValidateSummary> checked(std::span<const std::byte> bytes, std::string_view name,
                                       const ParallelLoop& loop) try {
  const auto summary = loop ? validate(bytes, loop) : validate(bytes);
  if (summary) return *summary;
  return tl::unexpected(
      build::Error{build::ErrorCode::kInvalidInput, std::string(name) + ": " + to_string(summary.error())});
} catch (const std::bad_alloc&) {
  return tl::unexpected(
      build::Error{build::ErrorCode::kOutOfMemory, std::string(name) + ": not enough memory to check the file"});
}

}  // namespace

build::Result<SceneFile> open_scene(std::span<const std::byte> bytes, std::string_view name, const ParallelLoop& loop) {
  if (reinterpret_cast<std::uintptr_t>(bytes.data()) % kSectionAlignment != 0) try {
      build::Buffer copy = build::Buffer::uninitialized(bytes.size());
      std::memcpy(copy.bytes().data(), bytes.data(), bytes.size());
      return open_scene(std::move(copy), name, loop);
    } catch (const std::bad_alloc&) {
      return tl::unexpected(
          build::Error{build::ErrorCode::kOutOfMemory, std::string(name) + ": not enough memory to align the file"});
    }
  const auto summary = checked(bytes, name, loop);
  if (!summary) return tl::unexpected(summary.error());
  SceneFile file;
  file.view_ = *open_buffer(bytes);
  file.summary_ = *summary;
  return file;
}

build::Result<SceneFile> open_scene(build::Buffer buffer, std::string_view name, const ParallelLoop& loop) {
  const auto summary = checked(std::as_const(buffer).bytes(), name, loop);
  if (!summary) return tl::unexpected(summary.error());
  SceneFile file;
  file.buffer_ = std::move(buffer);
  file.view_ = *open_buffer(std::as_const(file.buffer_).bytes());
  file.summary_ = *summary;
  return file;
}

build::Result<SceneFile> open_scene(const std::string& path, const ParallelLoop& loop) {
  auto buffer = build::map_file(path);
  if (!buffer) return tl::unexpected(buffer.error());
  return open_scene(*std::move(buffer), path, loop);
}

}  // namespace hiprt
