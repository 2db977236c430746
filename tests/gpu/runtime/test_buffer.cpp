// Device memory: copies, owners, allocators.

#include <hiprt_build/gpu/device_buffer.h>
#include <tests/gpu/counting_allocator.h>
#include <tests/gpu/recorder.h>
#include <tests/gpu/results.h>
#include <tests/oracle/random.h>

#include <numeric>

using namespace hiprt;
using namespace hiprt::checks;
using Catch::Matchers::Contains;
using gpu::DeviceArray;
using gpu::DeviceBuffer;
using gpu::ErrorCode;

namespace {

constexpr std::uint64_t kSeed = 21;

std::vector<std::byte> random_bytes(std::size_t count) {
  oracle::Random random(kSeed);
  std::vector<std::byte> bytes(count);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random.bits());
  return bytes;
}

std::vector<unsigned> numbers(unsigned count) {
  std::vector<unsigned> result(count);
  std::iota(result.begin(), result.end(), 1000u);
  return result;
}

/// numbers(count) on the device, copied before it returns.
DeviceArray<unsigned> uploaded(unsigned count, hipStream_t stream, gpu::Allocator& allocator) {
  const std::vector<unsigned> values = numbers(count);
  auto array = must(DeviceArray<unsigned>::from(values, stream, allocator));
  REQUIRE(hipStreamSynchronize(stream) == hipSuccess);
  return array;
}

template <class Allocator> void check_round_trip() {
  const Stream stream;
  Allocator allocator;
  for (const std::size_t size : {1u, 255u, 4096u, 1000003u}) {
    const std::vector<std::byte> bytes = random_bytes(size);
    DeviceBuffer buffer = must(DeviceBuffer::make(size, stream, allocator));
    REQUIRE(buffer.size() == size);
    CHECK(reinterpret_cast<std::uintptr_t>(buffer.data()) % gpu::kDeviceAlignment == 0);
    must(buffer.upload(bytes, stream));
    std::vector<std::byte> back(size);
    must(buffer.download(back, stream));
    REQUIRE(hipStreamSynchronize(stream) == hipSuccess);
    CHECK(back == bytes);
  }
}

}  // namespace

TEST_CASE("bytes are the same after a round trip") {
  SECTION("hipMalloc") { check_round_trip<gpu::DeviceAllocator>(); }
  SECTION("hipMallocAsync") { check_round_trip<gpu::StreamAllocator>(); }
  SECTION("the caller's") { check_round_trip<CountingAllocator>(); }
}

TEST_CASE("elements are the same after a round trip, also in parts") {
  const Stream stream;
  gpu::DeviceAllocator allocator;
  std::vector<unsigned> expected = numbers(1000);
  auto array = must(DeviceArray<unsigned>::from(expected, stream, allocator));
  CHECK(array.size() == 1000);
  CHECK(array.size_bytes() == 4000);
  CHECK(must(array.to_vector(stream)) == expected);
  const std::vector<unsigned> part{7, 8, 9};
  must(array.upload(part, stream, 997));
  std::copy(part.begin(), part.end(), expected.begin() + 997);
  CHECK(must(array.to_vector(stream)) == expected);
  std::vector<unsigned> tail(4);
  must(array.download(tail, stream, 996));
  REQUIRE(hipStreamSynchronize(stream) == hipSuccess);
  CHECK(tail == std::vector<unsigned>{1996, 7, 8, 9});
  must(array.fill(std::byte{0xa5}, stream));
  CHECK(must(array.to_vector(stream)) == std::vector<unsigned>(1000, 0xa5a5a5a5u));
}

TEST_CASE("copies beyond the end are refused with their sizes") {
  const Stream stream;
  gpu::DeviceAllocator allocator;
  auto array = uploaded(10, stream, allocator);
  std::vector<unsigned> eleven(11), two(2);
  constexpr std::size_t kHuge = std::numeric_limits<std::size_t>::max();
  for (const auto& result : {array.upload(eleven, stream), array.download(eleven, stream), array.upload(two, stream, 9),
                             array.download(two, stream, 9), array.upload(two, stream, kHuge),
                             array.download(two, stream, kHuge / 4 + 2), array.upload({}, stream, 11)})
    CHECK(error_of(result).code == ErrorCode::kInvalidInput);
  CHECK(error_of(array.upload(two, stream, 9)).message == "upload of 2 elements at element 9 of an array of 10");
  auto buffer = must(DeviceBuffer::make(10, stream, allocator));
  const std::vector<std::byte> bytes(8);
  CHECK(error_of(buffer.upload(bytes, stream, 3)).message == "upload of 8 bytes at byte 3 of a buffer of 10 bytes");
  CHECK(error_of(buffer.upload(bytes, stream, kHuge)).code == ErrorCode::kInvalidInput);
  CHECK(must(array.to_vector(stream)) == numbers(10));
}

TEST_CASE("an empty buffer needs no memory, no stream and no device") {
  CountingAllocator allocator;
  start_recording();
  auto buffer = must(DeviceBuffer::make(0, nullptr, allocator));
  auto array = must(DeviceArray<unsigned>::from({}, nullptr, allocator));
  must(buffer.upload({}, nullptr));
  must(buffer.download({}, nullptr));
  must(buffer.fill(std::byte{1}, nullptr));
  must(array.upload({}, nullptr));
  buffer.release();
  CHECK(taken().empty());
  CHECK(allocator.calls == 0);
  CHECK(buffer.data() == nullptr);
  CHECK(array.data() == nullptr);
  CHECK(array.empty());
  CHECK(must(array.to_vector(nullptr)).empty());
  CHECK(DeviceBuffer().size() == 0);
}

TEST_CASE("a buffer has one owner") {
  const Stream stream, other;
  CountingAllocator allocator;
  {
    auto a = uploaded(100, stream, allocator);
    unsigned* const data = a.data();
    DeviceArray<unsigned> b = std::move(a);
    CHECK(a.data() == nullptr);  // NOLINT(bugprone-use-after-move)
    CHECK(a.empty());
    CHECK(b.data() == data);
    auto c = must(DeviceArray<unsigned>::make(50, stream, allocator));
    CHECK(allocator.balance() == 600);
    c = std::move(b);
    CHECK(allocator.balance() == 400);
    CHECK(c.data() == data);
    DeviceArray<unsigned>& alias = c;
    c = std::move(alias);
    CHECK(c.data() == data);
    CHECK(must(c.to_vector(stream)) == numbers(100));
    c.release();
    CHECK(allocator.balance() == 0);
    c.release();
    c = must(DeviceArray<unsigned>::make(10, stream, allocator));
    c.free_on(other);
  }
  CHECK(allocator.balance() == 0);
  CHECK(allocator.bad_frees == 0);
  CHECK(allocator.calls == 3);
  CHECK(allocator.streams == std::vector<hipStream_t>{stream, stream, stream});
  CHECK(allocator.freed_on == std::vector<hipStream_t>{stream, stream, other});
}

TEST_CASE("too much memory is refused with the bytes wanted and free") {
  const Stream stream;
  std::size_t free_bytes = 0, total_bytes = 0;
  REQUIRE(hipMemGetInfo(&free_bytes, &total_bytes) == hipSuccess);
  const std::size_t wanted = total_bytes + (std::size_t{1} << 40);
  gpu::DeviceAllocator plain;
  gpu::StreamAllocator ordered;
  for (gpu::Allocator* allocator : {static_cast<gpu::Allocator*>(&plain), static_cast<gpu::Allocator*>(&ordered)}) {
    const gpu::Error error = error_of(DeviceBuffer::make(wanted, stream, *allocator));
    CHECK(error.code == ErrorCode::kOutOfMemory);
    CHECK_THAT(error.message, Contains(std::to_string(wanted) + " bytes wanted"));
    CHECK_THAT(error.message, Contains(" of " + std::to_string(total_bytes) + " bytes free"));
  }
  const gpu::Error error = error_of(DeviceArray<double>::make(std::size_t{1} << 61, stream, plain));
  CHECK(error.code == ErrorCode::kTooLarge);
  CHECK_THAT(error.message, Contains("2305843009213693952 elements of 8 bytes"));
  // The device is as good as before.
  CHECK(must(uploaded(5, stream, plain).to_vector(stream)) == numbers(5));
}

TEST_CASE("impossible alignments and allocators that do not align are refused") {
  const Stream stream;
  gpu::DeviceAllocator plain;
  gpu::StreamAllocator ordered;
  for (const std::size_t alignment : {0u, 3u, 512u}) {
    CHECK(error_of(plain.allocate(64, alignment, stream)).code == ErrorCode::kInvalidInput);
    CHECK_THAT(error_of(ordered.allocate(64, alignment, stream)).message, Contains(std::to_string(alignment)));
  }
  CountingAllocator crooked;
  crooked.offset = 16;
  const gpu::Error error = error_of(DeviceBuffer::make(1000, stream, crooked));
  CHECK(error.code == ErrorCode::kInvalidInput);
  CHECK_THAT(error.message, Contains("16 bytes behind a multiple of 256"));
  CHECK(crooked.balance() == 0);
  CHECK(crooked.bad_frees == 0);
  CHECK(must(DeviceBuffer::make(1000, stream, crooked, 16)).size() == 1000);
}

TEST_CASE("memory is released when a copy fails") {
  const Stream stream;
  CountingAllocator allocator;
  const std::vector<unsigned> values = numbers(100);
  fail_next("MemcpyAsync", hipErrorInvalidValue);
  const gpu::Error error = error_of(DeviceArray<unsigned>::from(values, stream, allocator));
  CHECK(error.code == ErrorCode::kGpu);
  CHECK_THAT(error.message, Contains("400 bytes to the device"));
  CHECK(allocator.calls == 1);
  CHECK(allocator.balance() == 0);
  const auto array = uploaded(100, stream, allocator);
  fail_next("StreamSynchronize", hipErrorInvalidValue);
  CHECK(error_of(array.to_vector(stream)).code == ErrorCode::kGpu);
}

TEST_CASE("every operation uses the caller's stream") {
  const Stream stream, other;
  const auto streams_of = [](auto&& work) {
    start_recording();
    work();
    std::vector<hipStream_t> streams;
    for (const Call& call : taken()) streams.push_back(call.stream);
    return streams;
  };
  gpu::StreamAllocator allocator;
  DeviceArray<unsigned> array;
  const std::vector<unsigned> values = numbers(10);
  std::vector<unsigned> back(10);
  using Streams = std::vector<hipStream_t>;
  CHECK(streams_of([&] { array = must(DeviceArray<unsigned>::from(values, stream, allocator)); }) ==
        Streams{stream, stream});
  CHECK(streams_of([&] { must(array.upload(values, other)); }) == Streams{other});
  CHECK(streams_of([&] { must(array.download(back, other)); }) == Streams{other});
  CHECK(streams_of([&] { must(array.fill(std::byte{0}, other)); }) == Streams{other});
  CHECK(streams_of([&] { must(array.to_vector(other)); }) == Streams{other, other});
  CHECK(streams_of([&] { array.release(); }) == Streams{stream});
}
