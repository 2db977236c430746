#include "load.h"

#include <tools/scene_io/query_file.h>

#include <limits>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using tools::QueryShape;

TEST_CASE("Query files: written and read back bit for bit") {
  const TempFolder folder;
  const float inf = std::numeric_limits<float>::infinity();
  for (const QueryShape shape : {QueryShape::kPoint, QueryShape::kSphere, QueryShape::kBox}) {
    const auto width = static_cast<std::size_t>(shape);
    std::vector<float> values(2 * width, 1e-40f);
    values[0] = -0.0f;
    values[width] = inf;
    REQUIRE(tools::write_queries(folder / "a", {shape, values}));
    CHECK(read_file(folder / "a").size() == 8 + 4 * values.size());
    const auto batch = tools::read_queries(folder / "a", shape);
    REQUIRE(batch);
    CHECK((batch->size() == 2 && batch->values == values && std::signbit(batch->values[0])));
    CHECK(batch->at(1)[0] == inf);
    REQUIRE(tools::write_queries(folder / "a", {shape, {}}));
    CHECK(tools::read_queries(folder / "a", shape)->size() == 0);
  }
}

TEST_CASE("Query files: other shapes and sizes that do not fit are refused with both numbers") {
  const TempFolder folder;
  const auto message = [&](const std::string& bytes, QueryShape shape) {
    const auto refused = tools::read_queries(folder.write("bad.queries", bytes), shape);
    REQUIRE(!refused);
    CHECK_THAT(refused.error().message, Contains("bad.queries"));
    return refused.error().message;
  };
  std::string bytes;
  append(bytes, 1u, 3u, 0.0f, 0.0f, 0.0f);
  CHECK_THAT(message("", QueryShape::kPoint), Contains("empty"));
  CHECK_THAT(message(bytes.substr(0, 7), QueryShape::kPoint), Contains("7 bytes are too few"));
  CHECK_THAT(message(bytes, QueryShape::kBox), Contains("byte 4 is 3 (points)") && Contains("boxes has 6"));
  CHECK_THAT(message(bytes.substr(0, 19), QueryShape::kPoint),
             Contains("1 points") && Contains("20 bytes") && Contains("the file has 19"));
  CHECK_THAT(message(bytes + "x", QueryShape::kPoint), Contains("the file has 21"));
  bytes[4] = 5;
  CHECK_THAT(message(bytes, QueryShape::kSphere), Contains("byte 4 is 5 (no shape") && Contains("spheres has 4"));
  std::string huge;
  append(huge, 0xffffffffu, 6u);
  CHECK_THAT(message(huge, QueryShape::kBox), Contains("4294967295 boxes") && Contains("103079215088 bytes"));
  const auto missing = tools::read_queries(folder / "none", QueryShape::kPoint);
  CHECK((!missing && missing.error().code == build::ErrorCode::kIo));
}

TEST_CASE("Query files: results and lists are a header, numbers and records; a file is whole or the old one") {
  const TempFolder folder;
  const std::vector<std::uint32_t> records{5, 6, 7};
  REQUIRE(tools::write_results(folder / "r", 1, 3, std::as_bytes(std::span{records})));
  std::string expected;
  append(expected, 1u, 3u, 5u, 6u, 7u);
  CHECK(read_file(folder / "r") == expected);
  const std::vector<std::uint64_t> first{0, 2, 3};
  REQUIRE(tools::write_lists(folder / "r", first, std::as_bytes(std::span{records})));
  expected.clear();
  append(expected, 2u, 0u, std::uint64_t{0}, std::uint64_t{2}, std::uint64_t{3}, 5u, 6u, 7u);
  CHECK(read_file(folder / "r") == expected);
  CHECK_THAT(tools::write_lists(folder / "no/such", first, {}).error().message, Contains("such"));
  CHECK(folder.names() == std::vector<std::string>{"r"});
}
