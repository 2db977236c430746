// A user who has a BVH file and no builder. Here the file is too short to be one, and is refused with the reason.

#include <hiprt_build/open_scene.h>
#include <hiprt_device/hiprt_device.h>

#include <array>
#include <cstdio>

int main() {
  alignas(hiprt::kSectionAlignment) const std::array<std::byte, 16> bytes{};
  const auto file = hiprt::open_scene(bytes, "sixteen zeros");
  if (file) return 1;
  std::printf("%s\n", file.error().message.c_str());
  return file.error().code == hiprt::build::ErrorCode::kInvalidInput ? 0 : 1;
}
