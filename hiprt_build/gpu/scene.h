#pragma once
/// A BVH file on the device, ready to be traced.

#include <hiprt_build/gpu/device_buffer.h>
#include <hiprt_device/scene_view.h>

namespace hiprt::gpu {

/// The file's bytes on the device, and the view of them that kernels take by value.
struct DeviceScene {
  DeviceBuffer buffer;
  SceneView view;  ///< Points into buffer; valid as long as it.
};

/// Copies an opened file to the device, in one piece.
/// @param view of open_buffer() or validate(): its bytes must live until the stream has passed the copy.
/// @return the errors of DeviceBuffer.
inline Result<DeviceScene> upload_scene(const BufferView& view, hipStream_t stream, Allocator& allocator) {
  static_assert(kDeviceAlignment % kBufferAlignment == 0);
  auto buffer = DeviceBuffer::make(view.bytes.size(), stream, allocator, kBufferAlignment);
  if (!buffer) return tl::unexpected(std::move(buffer.error()));
  if (auto copied = buffer->upload(view.bytes, stream); !copied) return tl::unexpected(std::move(copied.error()));
  const std::byte* base = buffer->data();
  return DeviceScene{std::move(*buffer), make_scene_view(view, base)};
}

/// The same from a file's bytes, whose header and section table are checked; the content is trusted: call validate()
/// for files of unknown origin.
/// @param bytes the whole file, aligned to 128 bytes.
/// @return kInvalidInput with what is wrong with the file and where, or the errors of DeviceBuffer.
inline Result<DeviceScene> upload_scene(std::span<const std::byte> bytes, hipStream_t stream, Allocator& allocator) {
  const auto view = open_buffer(bytes);
  if (!view) return fail(ErrorCode::kInvalidInput, "not a BVH file: ", to_string(view.error()));
  return upload_scene(*view, stream, allocator);
}

}  // namespace hiprt::gpu
