#include <hiprt_build/buffer.h>
#include <hiprt_device/format/buffer.h>

#include <tests/catch.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

using hiprt::build::Buffer;

TEST_CASE("a buffer is aligned and zero-filled") {
  for (const std::size_t size : {1u, 255u, 256u, 4097u}) {
    const Buffer buffer(size);
    CHECK(buffer.size() == size);
    CHECK(reinterpret_cast<std::uintptr_t>(buffer.bytes().data()) % hiprt::kBufferAlignment == 0);
    CHECK(std::all_of(buffer.bytes().begin(), buffer.bytes().end(), [](std::byte b) { return b == std::byte{0}; }));
  }
}

TEST_CASE("a buffer whose bytes are not set yet is as large and aligned, and can be written to its end") {
  for (const std::size_t size : {1u, 4097u, (2u << 20) + 1}) {
    Buffer buffer = Buffer::uninitialized(size);
    CHECK(buffer.size() == size);
    CHECK(reinterpret_cast<std::uintptr_t>(buffer.bytes().data()) % hiprt::kBufferAlignment == 0);
    std::fill(buffer.bytes().begin(), buffer.bytes().end(), std::byte{5});
    CHECK(buffer.bytes().back() == std::byte{5});
  }
  CHECK(Buffer::uninitialized(0).bytes().empty());
}

TEST_CASE("empty buffers") {
  CHECK(Buffer().size() == 0);
  const Buffer none(0);
  CHECK(none.bytes().empty());
}

TEST_CASE("a moved buffer keeps its bytes, and its source is empty") {
  Buffer first(100);
  first.bytes()[42] = std::byte{7};
  const std::byte* address = first.bytes().data();
  Buffer second(std::move(first));
  CHECK(second.bytes().data() == address);
  CHECK(first.size() == 0);  // NOLINT(bugprone-use-after-move): documented to be empty.
  Buffer third(10);
  third = std::move(second);
  CHECK(third.bytes()[42] == std::byte{7});
  CHECK(second.bytes().empty());  // NOLINT(bugprone-use-after-move)
  Buffer& same = third;
  third = std::move(same);
  CHECK(third.bytes().data() == address);
}

TEST_CASE("foreign memory is released once") {
  std::array<std::byte, 16> memory{};
  int released = 0;
  const auto release = [&](std::byte* data, std::size_t size) {
    CHECK(data == memory.data());
    CHECK(size == memory.size());
    ++released;
  };
  {
    Buffer buffer(memory.data(), memory.size(), release);
    Buffer moved(std::move(buffer));
    CHECK(released == 0);
    moved = Buffer(8);
    CHECK(released == 1);
  }
  CHECK(released == 1);
}
