#include <hiprt_build/file.h>
#include <hiprt_build/format/out_of_memory.h>
#include <hiprt_build/open_scene.h>

#include <cstdint>
#include <cstring>
#include <new>
#include <utility>

namespace hiprt {

namespace {

build::Result<ValidateSummary> checked(std::span<const std::byte> bytes, std::string_view name,
                                       const ParallelLoop& loop) {
  const auto summary = loop ? validate(bytes, loop) : validate(bytes);
  if (summary) return *summary;
  return tl::unexpected(
      build::Error{build::ErrorCode::kInvalidInput, std::string(name) + ": " + to_string(summary.error())});
}

/// @return work(); kOutOfMemory with the file's name if it throws std::bad_alloc.
template <class Work> build::Result<SceneFile> guarded(std::string_view name, const Work& work) try {
  return work();
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(build::out_of_memory({"to open ", name}, failure));
}

}  // namespace

build::Result<SceneFile> open_scene(std::span<const std::byte> bytes, std::string_view name, const ParallelLoop& loop) {
  return guarded(name, [&]() -> build::Result<SceneFile> {
    if (reinterpret_cast<std::uintptr_t>(bytes.data()) % kSectionAlignment != 0) {
      build::Buffer copy = build::Buffer::uninitialized(bytes.size());
      std::memcpy(copy.bytes().data(), bytes.data(), bytes.size());
      return open_scene(std::move(copy), name, loop);
    }
    const auto summary = checked(bytes, name, loop);
    if (!summary) return tl::unexpected(summary.error());
    SceneFile file;
    file.view_ = *open_buffer(bytes);
    file.summary_ = *summary;
    return file;
  });
}

build::Result<SceneFile> open_scene(build::Buffer buffer, std::string_view name, const ParallelLoop& loop) {
  return guarded(name, [&]() -> build::Result<SceneFile> {
    const auto summary = checked(std::as_const(buffer).bytes(), name, loop);
    if (!summary) return tl::unexpected(summary.error());
    SceneFile file;
    file.buffer_ = std::move(buffer);
    file.view_ = *open_buffer(std::as_const(file.buffer_).bytes());
    file.summary_ = *summary;
    return file;
  });
}

build::Result<SceneFile> open_scene(const std::string& path, const ParallelLoop& loop) {
  return guarded(path, [&]() -> build::Result<SceneFile> {
    auto buffer = build::map_file(path);
    if (!buffer) return tl::unexpected(buffer.error());
    return open_scene(*std::move(buffer), path, loop);
  });
}

}  // namespace hiprt
