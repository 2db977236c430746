// A user who has a BVH file and no builder. Here the file is too short to be one, and is refused with the reason.

#include <hiprt_build/format/validate.h>
#include <hiprt_device/hiprt_device.h>

#include <array>
#include <cstdio>

int main() {
  alignas(hiprt::kSectionAlignment) const std::array<std::byte, 16> bytes{};
  const auto view = hiprt::validate(bytes);
  if (view) return 1;
  std::printf("refused with code %u\n", static_cast<unsigned>(view.error().error));
  return view.error().error == hiprt::FormatError::kTooSmall ? 0 : 1;
}
