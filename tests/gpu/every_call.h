#pragma once
/// Lets each GPU runtime call of an operation fail in turn.

#include <hiprt_build/gpu/gpu.h>
#include <hiprt_build/gpu/instances.h>
#include <tests/gpu/builders/build_input.h>
#include <tests/gpu/recorder.h>

#include <tests/catch.h>

#include <cstdio>
#include <string>
#include <vector>

namespace hiprt::checks {

using Bytes = std::vector<std::byte>;
using Allocation = CountingAllocator;

/// operation(allocator) returns a Result of bytes. Runs it once for each call that can fail.
template <class Operation> void check_every_call(const std::string& name, const Operation& operation) {
  CAPTURE(name);
  Allocation allocator;
  const Bytes expected = must(operation(allocator));
  fail_call(0);
  REQUIRE(must(operation(allocator)) == expected);
  const unsigned count = calls_that_may_fail();
  REQUIRE(count > 0);
  unsigned errors = 0;
  for (unsigned number = 1; number <= count; ++number) {
    CAPTURE(number, count);
    fail_call(number);
    gpu::Result<Bytes> result = operation(allocator);
    calls_that_may_fail();
    // A wait before memory is freed may fail: nothing needs it.
    if (result) {
      CHECK(*result == expected);
    } else {
      ++errors;
      const gpu::Error& error = result.error();
      CAPTURE(error.message);
      CHECK((error.code == gpu::ErrorCode::kGpu || error.code == gpu::ErrorCode::kOutOfMemory));
      CHECK(error.message.find('\n') == std::string::npos);
      CHECK(error.message.find("hip") != std::string::npos);
      if (error.code == gpu::ErrorCode::kOutOfMemory) {
        CHECK(error.message.find("bytes wanted") != std::string::npos);
        CHECK(error.message.find("bytes free") != std::string::npos);
      }
    }
    CHECK(allocator.balance() == 0);
    CHECK(allocator.bad_frees == 0);
    CHECK(hipGetLastError() == hipSuccess);
    if (number % 10 == 1) CHECK(must(operation(allocator)) == expected);
  }
  CHECK(must(operation(allocator)) == expected);
  std::printf("%s: %u calls failed in turn, %u errors, %u survived\n", name.c_str(), count, errors, count - errors);
}

inline Bytes bytes_of(const build::Buffer& file) { return {file.bytes().begin(), file.bytes().end()}; }

/// The bytes of a downloaded file without its provenance, which holds the time.
inline gpu::Result<Bytes> as_bytes(const gpu::Result<build::Buffer>& file) {
  if (!file) return tl::unexpected(file.error());
  Bytes bytes;
  for (const SectionKind kind : {SectionKind::kNodes, SectionKind::kLeaves, SectionKind::kPrimitiveMap}) {
    const auto part = section(*file, kind);
    bytes.insert(bytes.end(), part.begin(), part.end());
  }
  return bytes;
}

/// The memory of a build.
struct Memory {
  gpu::DeviceBuffer output, scratch;

  static gpu::Result<Memory> make(const gpu::Result<gpu::BuildSizes>& sizes, gpu::Allocator& allocator) {
    if (!sizes) return tl::unexpected(sizes.error());
    auto output = gpu::DeviceBuffer::make(sizes->output, nullptr, allocator);
    if (!output) return tl::unexpected(output.error());
    auto scratch = gpu::DeviceBuffer::make(sizes->scratch, nullptr, allocator);
    if (!scratch) return tl::unexpected(scratch.error());
    return Memory{std::move(*output), std::move(*scratch)};
  }
};

}  // namespace hiprt::checks
