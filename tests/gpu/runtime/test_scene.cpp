// BVH files on the device.

#include <hiprt_build/file.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/replicate.h>
#include <tests/gpu/counting_allocator.h>
#include <tests/gpu/recorder.h>
#include <tests/gpu/results.h>

#include <cstdlib>

using namespace hiprt;
using namespace hiprt::checks;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using gpu::ErrorCode;

namespace {

/// The environment's file, where the program runs away from the sources.
build::Buffer golden() {
  const char* path = std::getenv("HIPRT_GOLDEN_FILE");
  return must(build::map_file(path != nullptr ? path : HIPRT_GOLDEN_FILE));
}

}  // namespace

TEST_CASE("an uploaded scene is the file, in one allocation") {
  const Stream stream;
  CountingAllocator allocator;
  const build::Buffer file = golden();
  {
    start_recording();
    const gpu::DeviceScene scene = must(gpu::upload_scene(file.bytes(), stream, allocator));
    const std::vector<Call> calls = taken();
    REQUIRE(calls.size() == 1);
    CHECK(calls[0].name == "MemcpyAsync");
    CHECK(calls[0].stream == static_cast<hipStream_t>(stream));
    CHECK(allocator.calls == 1);
    CHECK(allocator.alignments == std::vector<std::size_t>{256});
    CHECK(scene.view.base == scene.buffer.data());
    CHECK(reinterpret_cast<std::uintptr_t>(scene.view.base) % 256 == 0);
    const SceneView host = make_scene_view(*open_buffer(file.bytes()));
    CHECK(scene.view.root == host.root);
    CHECK(scene.view.features == host.features);
    CHECK(scene.view.layout == host.layout);
    CHECK(scene.view.stack_bound == host.stack_bound);
    CHECK(reinterpret_cast<const std::byte*>(scene.view.geometries) - scene.view.base ==
          reinterpret_cast<const std::byte*>(host.geometries) - host.base);
    std::vector<std::byte> back(file.size());
    must(scene.buffer.download(back, stream));
    REQUIRE(hipStreamSynchronize(stream) == hipSuccess);
    CHECK(std::equal(back.begin(), back.end(), file.bytes().begin(), file.bytes().end()));
  }
  CHECK(allocator.balance() == 0);
  CHECK(allocator.bad_frees == 0);
}

TEST_CASE("an opened file can be uploaded as well") {
  const Stream stream;
  CountingAllocator allocator;
  const build::Buffer file = golden();
  const auto view = open_buffer(file.bytes());
  REQUIRE(view.has_value());
  gpu::DeviceScene scene = must(gpu::upload_scene(*view, stream, allocator));
  CHECK(scene.buffer.size() == file.size());
  const gpu::DeviceScene moved = std::move(scene);
  CHECK(moved.view.base == moved.buffer.data());
  CHECK(allocator.balance() == file.size());
}

TEST_CASE("data that is not a BVH file is not uploaded") {
  const Stream stream;
  CountingAllocator allocator;
  const build::Buffer file = golden();
  const std::span<const std::byte> bytes = file.bytes();
  const gpu::Error truncated = error_of(gpu::upload_scene(bytes.first(bytes.size() - 1), stream, allocator));
  CHECK(truncated.code == ErrorCode::kInvalidInput);
  CHECK_THAT(truncated.message,
             StartsWith("not a BVH file: 1196 bytes, but its header says 1197: the file is truncated"));
  CHECK_THAT(error_of(gpu::upload_scene(bytes.subspan(1), stream, allocator)).message, Contains("Misaligned"));
  CHECK_THAT(error_of(gpu::upload_scene(std::span<const std::byte>(), stream, allocator)).message,
             Contains("TooSmall"));
  CHECK(allocator.calls == 0);
}

TEST_CASE("a failed upload leaks nothing") {
  const Stream stream;
  CountingAllocator allocator;
  const build::Buffer file = golden();
  fail_next("MemcpyAsync", hipErrorInvalidValue);
  CHECK(error_of(gpu::upload_scene(file.bytes(), stream, allocator)).code == ErrorCode::kGpu);
  CHECK(allocator.balance() == 0);
  allocator.offset = 128;
  CHECK_THAT(error_of(gpu::upload_scene(file.bytes(), stream, allocator)).message,
             Contains("128 bytes behind a multiple of 256"));
  CHECK(allocator.balance() == 0);
}

TEST_CASE("replicas are copies of the scene, each in memory of its own") {
  const Stream stream;
  CountingAllocator allocator;
  const build::Buffer file = golden();
  {
    const gpu::DeviceScene scene = must(gpu::upload_scene(file.bytes(), stream, allocator));
    REQUIRE(hipStreamSynchronize(stream) == hipSuccess);
    std::vector<int> devices{0, 0};
    for (const gpu::Device& device : must(gpu::devices())) devices.push_back(device.index);
    const auto replicas = must(gpu::replicate(scene, 0, devices, allocator));
    REQUIRE(replicas.size() == devices.size());
    for (std::size_t i = 0; i < replicas.size(); ++i) {
      const auto& [device, copy] = replicas[i];
      CHECK(device == devices[i]);
      CHECK(copy.view.base == copy.buffer.data());
      CHECK(copy.view.base != scene.view.base);
      CHECK(copy.view.root == scene.view.root);
      CHECK(copy.view.instances == nullptr);
      CHECK(reinterpret_cast<const std::byte*>(copy.view.geometries) - copy.view.base ==
            reinterpret_cast<const std::byte*>(scene.view.geometries) - scene.view.base);
      const auto current = must(gpu::CurrentDevice::make(device));
      std::vector<std::byte> back(file.size());
      must(copy.buffer.download(back, nullptr));
      REQUIRE(hipStreamSynchronize(nullptr) == hipSuccess);
      CHECK(std::equal(back.begin(), back.end(), file.bytes().begin(), file.bytes().end()));
    }
    int now = -1;
    REQUIRE(hipGetDevice(&now) == hipSuccess);
    CHECK(now == 0);
  }
  CHECK(allocator.balance() == 0);
}

TEST_CASE("replicas on devices that do not exist, or without memory, are refused, and nothing is kept") {
  const Stream stream;
  CountingAllocator allocator;
  const build::Buffer file = golden();
  const gpu::DeviceScene scene = must(gpu::upload_scene(file.bytes(), stream, allocator));
  REQUIRE(hipStreamSynchronize(stream) == hipSuccess);
  const auto held = allocator.balance();
  for (const int device : {-1, 1000}) {
    const int devices[] = {0, device};
    const gpu::Error error = error_of(gpu::replicate(scene, 0, devices, allocator));
    CHECK(error.code == ErrorCode::kInvalidInput);
    CHECK_THAT(error.message, StartsWith("replicate, device " + std::to_string(device) + ": device " +
                                         std::to_string(device) + ": this machine has "));
    CHECK(allocator.balance() == held);
  }
  fail_next("MemcpyAsync", hipErrorInvalidValue);
  const int same[] = {0};
  CHECK_THAT(error_of(gpu::replicate(scene, 0, same, allocator)).message,
             StartsWith("replicate, device 0: hipMemcpyAsync"));
  CHECK(allocator.balance() == held);
  CHECK(must(gpu::replicate(scene, 0, std::span<const int>(), allocator)).empty());
}
