#include <hiprt_build/build.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/catch.h>

#include <string>

namespace hiprt {

TEST_CASE("the headers have the version of the library") {
  CHECK(build::version() == std::to_string(kVersion.major_number) + "." + std::to_string(kVersion.minor_number) + "." +
                                std::to_string(kVersion.patch_number));
  CHECK(HIPRT_LIBRARY_VERSION == 10000 * kVersion.major_number + 100 * kVersion.minor_number + kVersion.patch_number);
}

TEST_CASE("versions are compared by major, minor and patch number") {
  constexpr Version version{1, 4, 2};
  CHECK(version.at_least(1, 4, 2));
  CHECK(version.at_least(1, 4));
  CHECK(version.at_least(1, 3, 9));
  CHECK(version.at_least(0, 9, 9));
  CHECK_FALSE(version.at_least(1, 4, 3));
  CHECK_FALSE(version.at_least(1, 5));
  CHECK_FALSE(version.at_least(2, 0));
}

}  // namespace hiprt
