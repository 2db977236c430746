// Launches: limits and times.

#include <hiprt_build/gpu/device.h>
#include <hiprt_build/gpu/device_buffer.h>
#include <hiprt_build/gpu/event.h>
#include <hiprt_build/gpu/launch.h>
#include <tests/gpu/kernels.h>
#include <tests/gpu/recorder.h>
#include <tests/gpu/results.h>

#include <numeric>

using namespace hiprt;
using namespace hiprt::checks;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using gpu::DeviceArray;
using gpu::ErrorCode;
using gpu::launch;

TEST_CASE("a launch has a thread for every item") {
  const Stream stream;
  gpu::DeviceAllocator allocator;
  for (const unsigned count : {1u, 63u, 64u, 65u, 100000u})
    for (const unsigned block : {0u, 64u, 256u}) {
      CAPTURE(count, block);
      auto out = must(DeviceArray<unsigned>::make(count, stream, allocator));
      auto beyond = must(DeviceArray<unsigned>::make(1, stream, allocator));
      must(beyond.fill(std::byte{0}, stream));
      must(launch(write_indices, count, stream, {.block = block}, out.data(), 5u, count, beyond.data()));
      std::vector<unsigned> expected(count);
      std::iota(expected.begin(), expected.end(), 5u);
      CHECK(must(out.to_vector(stream)) == expected);
      const unsigned idle = must(beyond.to_vector(stream))[0];
      if (block != 0) CHECK(idle == (block - count % block) % block);
      CHECK(idle < 1024);
    }
}

TEST_CASE("a grid of two dimensions") {
  const Stream stream;
  gpu::DeviceAllocator allocator;
  auto out = must(DeviceArray<unsigned>::make(5 * 3 * 32, stream, allocator));
  must(launch(write_blocks, gpu::Grid{5, 3}, stream, {.block = 32}, out.data()));
  const std::vector<unsigned> blocks = must(out.to_vector(stream));
  for (unsigned i = 0; i < blocks.size(); ++i) REQUIRE(blocks[i] == i / 32);
}

TEST_CASE("dynamic shared memory") {
  const Stream stream;
  gpu::DeviceAllocator allocator;
  std::vector<unsigned> values(512);
  std::iota(values.begin(), values.end(), 0u);
  const auto in = must(DeviceArray<unsigned>::from(values, stream, allocator));
  auto out = must(DeviceArray<unsigned>::make(512, stream, allocator));
  must(launch(reverse_blocks, 512, stream, {.block = 128, .dynamic_shared_bytes = 512}, in.data(), out.data()));
  const std::vector<unsigned> reversed = must(out.to_vector(stream));
  for (unsigned i = 0; i < 512; ++i) REQUIRE(reversed[i] == i / 128 * 128 + 127 - i % 128);
}

TEST_CASE("a launch without items starts no kernel") {
  start_recording();
  must(launch(nothing, 0, nullptr, {}));
  CHECK(taken().empty());
}

TEST_CASE("a launch uses the caller's stream") {
  const Stream stream;
  start_recording();
  must(launch(nothing, 100, stream, {}));
  must(launch(nothing, gpu::Grid{2}, stream, {.block = 64}));
  must(gpu::persistent_grid(nothing, 64));
  const std::vector<Call> calls = taken();
  REQUIRE(calls.size() == 2);
  for (const Call& call : calls) {
    CHECK(call.name == "LaunchKernel");
    CHECK(call.stream == static_cast<hipStream_t>(stream));
  }
  REQUIRE(hipStreamSynchronize(stream) == hipSuccess);
}

TEST_CASE("sizes over a limit are refused before the launch, and the limit is named") {
  const Stream stream;
  const std::string block_limit = "the kernel's maxThreadsPerBlock, ";
  start_recording();
  const auto refused = [&](const gpu::Result<void>& result, const std::string& what) {
    const gpu::Error error = error_of(result);
    CHECK(error.code == ErrorCode::kInvalidInput);
    CHECK_THAT(error.message, StartsWith("launch of probe: grid "));
    CHECK_THAT(error.message, Contains(what));
  };
  refused(launch(nothing, 1, stream, {.block = 2048, .name = "probe"}), "block 2048 is over " + block_limit + "1024");
  refused(launch(small_blocks, 1, stream, {.block = 128, .name = "probe"}, nullptr),
          "block 128 is over " + block_limit + "64");
  refused(launch(nothing, 1, stream, {.block = 64, .dynamic_shared_bytes = 1 << 20, .name = "probe"}),
          "dynamic shared memory 1048576 is over the kernel's maxDynamicSharedSizeBytes, ");
  refused(launch(nothing, 1, stream, {.dynamic_shared_bytes = 1 << 20, .name = "probe"}), "is over");
  refused(launch(nothing, gpu::Grid{5, 0, 1}, stream, {.block = 64, .name = "probe"}),
          "grid 5 x 0 x 1, block 64, shared memory 0 + 0 bytes: the grid is empty");
  refused(launch(nothing, gpu::Grid{1, 1, 0xffffffffu}, stream, {.block = 64, .name = "probe"}),
          "grid 4294967295 is over the device's MaxGridDimZ, ");
  refused(launch(nothing, gpu::Grid{1u << 28}, stream, {.block = 64, .name = "probe"}),
          "threads along an axis 17179869184 is over 32 bits, 4294967295");
  refused(launch(nothing, std::uint64_t{1} << 32, stream, {.block = 1024, .name = "probe"}),
          "items 4294967296 is over 32 bits");
  CHECK(taken().empty());
}

TEST_CASE("a launch that fails carries its sizes") {
  const Stream stream;
  fail_next("LaunchKernel", hipErrorInvalidValue);
  const gpu::Error error =
      error_of(launch(nothing, 1000, stream, {.block = 64, .dynamic_shared_bytes = 128, .name = "probe"}));
  CHECK(error.code == ErrorCode::kGpu);
  CHECK_THAT(error.message, StartsWith("hipLaunchKernel: "));
  CHECK_THAT(error.message, Contains("launch of probe: grid 16 x 1 x 1, block 64, shared memory 0 + 128 bytes"));
}

TEST_CASE("a pointer that is not a kernel is refused") {
  void (*const function)() = [] {};
  CHECK(error_of(launch(function, 1, nullptr, {.name = "host code"})).code == ErrorCode::kGpu);
  CHECK_THAT(error_of(launch(function, 1, nullptr, {.name = "host code"})).message, Contains("host code"));
}

TEST_CASE("a persistent grid fills the device and no more") {
  const gpu::Device device = must(gpu::current_device());
  unsigned last = ~0u;
  for (const unsigned block : {64u, 256u, 1024u}) {
    const unsigned blocks = must(gpu::persistent_grid(nothing, block));
    CAPTURE(block, blocks);
    CHECK(blocks > 0);
    CHECK(blocks % device.compute_units == 0);
    CHECK(blocks / device.compute_units * block <= 4096);
    CHECK(blocks <= last);
    last = blocks;
  }
  const unsigned half = must(gpu::persistent_grid(nothing, 64, 20000));
  CHECK(half > 0);
  CHECK(half < must(gpu::persistent_grid(nothing, 64)));
  CHECK(error_of(gpu::persistent_grid(nothing, 0)).code == ErrorCode::kInvalidInput);
  CHECK(error_of(gpu::persistent_grid(nothing, 2048)).code == ErrorCode::kInvalidInput);
  CHECK(error_of(gpu::persistent_grid(nothing, 64, 1 << 20)).code == ErrorCode::kInvalidInput);
}

TEST_CASE("divide_l1() keeps the number of resident blocks") {
  const auto* kernel = reinterpret_cast<const void*>(nothing);
  const unsigned without = must(gpu::persistent_grid(nothing, 64));
  for (const std::size_t bytes :
       {std::size_t{0}, std::size_t{16}, std::size_t{3584}, std::size_t{20000}, std::size_t{16}, std::size_t{0}}) {
    CAPTURE(bytes);
    must(gpu::divide_l1(kernel, 64));
    const unsigned blocks = must(gpu::persistent_grid(nothing, 64, bytes));
    must(gpu::divide_l1(kernel, 64, bytes));
    CHECK(must(gpu::persistent_grid(nothing, 64, bytes)) == blocks);
  }
  CHECK(must(gpu::persistent_grid(nothing, 64)) == without);
  CHECK(error_of(gpu::divide_l1(kernel, 64, 1 << 20)).code == ErrorCode::kInvalidInput);
  CHECK(error_of(gpu::divide_l1(kernel, 2048)).code == ErrorCode::kInvalidInput);
}

TEST_CASE("a stopwatch measures what the stream does") {
  const Stream stream;
  gpu::DeviceAllocator allocator;
  auto memory = must(gpu::DeviceBuffer::make(1 << 24, stream, allocator));
  auto watch = must(gpu::StreamTimer::make());
  const auto measured = [&](int fills) {
    must(watch.start(stream));
    for (int i = 0; i < fills; ++i) must(memory.fill(static_cast<std::byte>(i), stream));
    must(watch.stop(stream));
    return must(watch.milliseconds());
  };
  measured(1);
  const float few = measured(1), many = measured(50);
  CAPTURE(few, many);
  CHECK(few >= 0.0f);
  CHECK(many > few);
  CHECK(many < 60000.0f);
}

TEST_CASE("events are owned, recorded on the caller's stream, and return errors") {
  const Stream stream;
  auto first = must(gpu::Event::make()), second = must(gpu::Event::make());
  CHECK(error_of(second.milliseconds_since(first)).code == ErrorCode::kGpu);
  start_recording();
  must(first.record(stream));
  must(second.record(stream));
  for (const Call& call : taken()) CHECK(call.stream == static_cast<hipStream_t>(stream));
  must(second.synchronize());
  CHECK(must(second.milliseconds_since(first)) >= 0.0f);
  const hipEvent_t handle = first.get();
  gpu::Event moved = std::move(first);
  CHECK(moved.get() == handle);
  CHECK(first.get() == nullptr);  // NOLINT(bugprone-use-after-move)
  CHECK(error_of(first.record(stream)).code == ErrorCode::kGpu);
  CHECK(must(second.milliseconds_since(moved)) >= 0.0f);
  fail_next("EventRecord", hipErrorInvalidValue);
  CHECK(error_of(moved.record(stream)).code == ErrorCode::kGpu);
}
