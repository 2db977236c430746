// Devices and the errors of the runtime's calls.

#include <hiprt_build/gpu/device.h>
#include <tests/gpu/recorder.h>
#include <tests/gpu/results.h>

#include <cstdlib>

using namespace hiprt;
using namespace hiprt::checks;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using gpu::ErrorCode;

TEST_CASE("the current device is one of all devices") {
  const std::vector<gpu::Device> all = must(gpu::devices());
  const gpu::Device current = must(gpu::current_device());
  REQUIRE(current.index >= 0);
  REQUIRE(static_cast<std::size_t>(current.index) < all.size());
  const gpu::Device& same = all[static_cast<std::size_t>(current.index)];
  CHECK(same.name == current.name);
  CHECK(same.architecture == current.architecture);
  CHECK(must(gpu::device(current.index)).memory_bytes == current.memory_bytes);
}

TEST_CASE("a device reports its properties") {
  const gpu::Device device = must(gpu::current_device());
  INFO(device.name << ", " << device.architecture);
  CHECK_FALSE(device.name.empty());
  CHECK(device.architecture.find(':') == std::string::npos);
  // Set by run_gpu_test.sh.
  if (const char* wanted = std::getenv("HIPRT_TEST_GPU_ARCH")) CHECK(device.architecture == wanted);
  CHECK(device.wave_size == (device.architecture.starts_with("gfx9") ? 64u : 32u));
  CHECK(device.compute_units > 0);
  CHECK(device.max_threads_per_block == 1024);
  CHECK(device.shared_bytes_per_block >= 32768);
  CHECK(device.memory_bytes >= std::uint64_t{1} << 30);
}

TEST_CASE("a missing device is refused with its number") {
  const auto count = static_cast<int>(must(gpu::devices()).size());
  for (const int index : {-1, count, count + 7}) {
    const gpu::Error error = error_of(gpu::device(index));
    CHECK(error.code == ErrorCode::kInvalidInput);
    CHECK_THAT(error.message, StartsWith("device " + std::to_string(index) + " of " + std::to_string(count)));
  }
}

TEST_CASE("querying devices does not change the current one") {
  start_recording();
  must(gpu::devices());
  must(gpu::current_device());
  CHECK(taken().empty());
}

TEST_CASE("an error carries the call, HIP's name for it, and the context") {
  CHECK(gpu::check(hipSuccess, "hipMalloc", "never seen").has_value());
  const gpu::Error error =
      error_of(gpu::check(hipErrorInvalidValue, "hipMemcpyAsync", std::string("copy of "), 12u, " bytes"));
  CHECK(error.code == ErrorCode::kGpu);
  CHECK_THAT(error.message, StartsWith("hipMemcpyAsync: "));
  CHECK_THAT(error.message, Contains("InvalidValue"));
  CHECK_THAT(error.message, Contains(", copy of 12 bytes"));
  CHECK_THAT(error.message, !Contains("bytes free"));
  const gpu::Error bare = error_of(gpu::check(hipErrorInvalidValue, "hipFree"));
  CHECK(bare.message.back() != ' ');
}

TEST_CASE("an out-of-memory error says how much is free") {
  std::size_t free_bytes = 0, total_bytes = 0;
  REQUIRE(hipMemGetInfo(&free_bytes, &total_bytes) == hipSuccess);
  const gpu::Error error = error_of(gpu::check(hipErrorOutOfMemory, "hipMalloc", 12345, " bytes wanted"));
  CHECK(error.code == ErrorCode::kOutOfMemory);
  CHECK_THAT(error.message, Contains(", 12345 bytes wanted, "));
  CHECK_THAT(error.message, Contains(" of " + std::to_string(total_bytes) + " bytes free"));
}

TEST_CASE("check() clears HIP's last error") {
  hipEvent_t never_recorded = nullptr, other = nullptr;
  float milliseconds = 0.0f;
  REQUIRE(hipEventCreate(&never_recorded) == hipSuccess);
  REQUIRE(hipEventCreate(&other) == hipSuccess);
  CHECK(error_of(gpu::check(hipEventElapsedTime(&milliseconds, never_recorded, other), "hipEventElapsedTime")).code ==
        ErrorCode::kGpu);
  CHECK(hipPeekAtLastError() == hipSuccess);
  CHECK(hipEventDestroy(never_recorded) == hipSuccess);
  CHECK(hipEventDestroy(other) == hipSuccess);
}
