#pragma once
/// Opens a BVH file for tracing in one call: maps it, checks it, and returns the view that queries take.
///
///     const auto file = hiprt::open_scene("scene.bvh");
///     if (!file) return std::fprintf(stderr, "%s\n", file.error().message.c_str());
///     const hiprt::Hit hit = hiprt::closest_hit(file->scene(), ray);
///
/// Each step can be called by itself: map_file() (file.h), validate() (format/validate.h), open_buffer() and
/// make_scene_view() (format/view.h). Needs the library hiprt::format only.

#include <hiprt_build/buffer.h>
#include <hiprt_build/error.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/host/host_part.h>

#include <span>
#include <string>
#include <string_view>

namespace hiprt {

/// A checked BVH file: its bytes and views of them.
class SceneFile {
 public:
  /// The view for the host, with what makes it fast there (HostPart). For a copy on a GPU call
  /// gpu::upload_scene(file.bytes(), ...), or make_scene_view(file.view(), address).
  SceneView scene() const { return host_.scene(view_); }
  const BufferView& view() const { return view_; }
  std::span<const std::byte> bytes() const { return view_.bytes; }
  /// The numbers that the checks have counted.
  const ValidateSummary& summary() const { return summary_; }

 private:
  friend HIPRT_BUILD_API build::Result<SceneFile> open_scene(build::Buffer, std::string_view, const ParallelLoop&);
  friend HIPRT_BUILD_API build::Result<SceneFile> open_scene(std::span<const std::byte>, std::string_view,
                                                             const ParallelLoop&);

  build::Buffer buffer_;  ///< Empty if the bytes are the caller's.
  BufferView view_;
  ValidateSummary summary_;
  HostPart host_;
};

/// Opens a file. It stays mapped as long as the result lives, and must not change during that time.
/// @param loop may check large scenes on many threads, see validate(). Empty: this thread.
/// @return kIo if the file cannot be read; kInvalidInput with the path, the fault and the byte; kOutOfMemory.
HIPRT_BUILD_API build::Result<SceneFile> open_scene(const std::string& path, const ParallelLoop& loop = {});

/// Opens a file in memory, which must outlive the result. Bytes that do not start at a multiple of 128 are copied.
/// @param name of the bytes, for messages.
HIPRT_BUILD_API build::Result<SceneFile> open_scene(std::span<const std::byte> bytes, std::string_view name = "BVH",
                                                    const ParallelLoop& loop = {});

/// Opens a file in memory, which the result then owns.
HIPRT_BUILD_API build::Result<SceneFile> open_scene(build::Buffer buffer, std::string_view name = "BVH",
                                                    const ParallelLoop& loop = {});

}  // namespace hiprt
