#pragma once
/// A BVH file on the device, ready to be traced.

#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/device_buffer.h>
#include <hiprt_device/scene_view.h>

namespace hiprt::gpu {

/// The file's bytes on the device, and the view of them that kernels take by value.
struct DeviceScene {
  DeviceBuffer buffer;
  SceneView view;  ///< Points into buffer; valid as long as it. Its base is behind the capacity that was asked for.
};

/// Copies an opened file to the device, in one piece.
/// @param view of open_buffer() or validate(): its bytes must live until the stream has passed the copy.
/// @param capacity bytes before the file in the same buffer, for trees over its objects (instances.h).
/// @return the errors of DeviceBuffer, or kInvalidInput if the capacity is no multiple of 256.
inline Result<DeviceScene> upload_scene(const BufferView& view, hipStream_t stream, Allocator& allocator,
                                        std::uint64_t capacity = 0) {
  static_assert(kDeviceAlignment % kBufferAlignment == 0);
  if (capacity % kBufferAlignment != 0)
    return fail(ErrorCode::kInvalidInput, "upload_scene: capacity of ", capacity, " bytes, which is no multiple of ",
                kBufferAlignment);
  auto buffer = DeviceBuffer::make(capacity + view.bytes.size(), stream, allocator, kBufferAlignment);
  if (!buffer) return tl::unexpected(std::move(buffer.error()));
  if (auto copied = buffer->upload(view.bytes, stream, capacity); !copied)
    return tl::unexpected(std::move(copied.error()));
  const std::byte* base = buffer->data() + capacity;
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
