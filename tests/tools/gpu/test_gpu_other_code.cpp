/// A GPU whose architecture this build has no code for. Linked with usable_device() for gfx000 and sm_00.

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <tools/cli/trace_device.h>

#include <tests/catch.h>

#include <cstdlib>

using namespace hiprt;
using namespace hiprt::tools;

TEST_CASE("--device gpu names the device's architecture and those of the code; auto is the CPU") {
  const auto bvh = build::build(build::SceneInput{});
  REQUIRE(bvh.has_value());
  const auto view = open_buffer(bvh->buffer.bytes());
  REQUIRE(view.has_value());
  const auto refused = choose_device(DeviceChoice::kGpu, *view);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == build::ErrorCode::kNoDevice);
  const std::string architecture = std::getenv("HIPRT_TEST_GPU_ARCH");
  CHECK_THAT(refused.error().message, Catch::Contains("its architecture, " + architecture +
                                                      ", is not among those that "
                                                      "this build has code for, gfx000 sm_00"));
  const auto fallback = choose_device(DeviceChoice::kAuto, *view);
  REQUIRE(fallback.has_value());
  CHECK_FALSE(fallback->has_value());
}
