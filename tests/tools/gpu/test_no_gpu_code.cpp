/// Builds without GPU code (HIPRT_GPU=OFF): linked with tools/render/tracers/gpu_tracer_off.cpp.

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <tools/cli/trace_device.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::tools;

TEST_CASE("without GPU code --device gpu says so, and auto and cpu are the CPU") {
  const auto bvh = build::build(build::SceneInput{});
  REQUIRE(bvh.has_value());
  const auto view = open_buffer(bvh->buffer.bytes());
  REQUIRE(view.has_value());
  const auto refused = choose_device(DeviceChoice::kGpu, *view);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == build::ErrorCode::kNoDevice);
  CHECK(refused.error().message == "GPU: no GPU code in this build (the reason)");
  for (const DeviceChoice choice : {DeviceChoice::kAuto, DeviceChoice::kCpu}) {
    const auto cpu = choose_device(choice, *view);
    REQUIRE(cpu.has_value());
    CHECK_FALSE(cpu->has_value());
    CHECK(device_word(*cpu) == "cpu");
    CHECK(device_name(*cpu) == trace_isa());
  }
}
