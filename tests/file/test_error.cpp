#include <hiprt_build/error.h>

#include <tests/catch.h>

#include <cstddef>
#include <set>
#include <string>

using hiprt::build::Error;
using hiprt::build::ErrorCode;

// Programs that are linked with an older library read this layout. The abi test does not see it.
static_assert(offsetof(Error, message) == 8 && sizeof(Error) == 8 + sizeof(std::string));

TEST_CASE("every error code has a name of its own") {
  std::set<std::string> names;
  for (const ErrorCode code :
       {ErrorCode::kInvalidInput, ErrorCode::kTooLarge, ErrorCode::kOutOfMemory, ErrorCode::kCancelled, ErrorCode::kIo,
        ErrorCode::kBackend, ErrorCode::kNoDevice, ErrorCode::kGpu})
    names.insert(hiprt::build::name(code));
  CHECK(names.size() == 8);
  CHECK(names.count("unknown error") == 0);
  CHECK(std::string(hiprt::build::name(ErrorCode::kInvalidInput)) == "invalid input");
}
