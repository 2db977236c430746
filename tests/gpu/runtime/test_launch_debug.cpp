// In debug builds launch() says when a scene is not in the device's memory. This source is one, whatever the others
// are.

#undef NDEBUG

#include <hiprt_build/gpu/device_buffer.h>
#include <hiprt_build/gpu/launch.h>
#include <tests/gpu/kernels.h>
#include <tests/gpu/recorder.h>
#include <tests/gpu/results.h>

using namespace hiprt;
using namespace hiprt::checks;
using Catch::Matchers::Contains;

TEST_CASE("debug builds: a scene of host memory is not launched") {
  const Stream stream;
  gpu::DeviceAllocator allocator;
  auto size = must(gpu::DeviceArray<std::uint64_t>::make(1, stream, allocator));
  const auto bytes = must(gpu::DeviceArray<std::byte>::make(256, stream, allocator));
  std::vector<std::byte> host(256);
  SceneView scene;
  scene.size = 256;

  scene.base = host.data();
  const auto refused = gpu::launch(write_scene_size, 1, stream, {.block = 64, .name = "trace"}, scene, size.data());
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == gpu::ErrorCode::kInvalidInput);
  CHECK_THAT(refused.error().message, Contains("launch of trace"));
  CHECK_THAT(refused.error().message, Contains("the SceneView is of host memory"));

  scene.base = bytes.data();
  must(gpu::launch(write_scene_size, 1, stream, {.block = 64}, scene, size.data()));
  CHECK(must(size.to_vector(stream))[0] == 256);
}
