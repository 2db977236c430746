#include "load.h"

#include <tools/scene_io/npy_file.h>
#include <tools/scene_io/query_npy.h>

#include <array>
#include <limits>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using tools::QueryShape;

namespace {

/// A .npy file with a dictionary of any text.
std::string npy(const std::string& dictionary, const std::string& values, char version = 1) {
  std::string bytes = std::string("\x93NUMPY") + version + '\0';
  const auto length = static_cast<std::uint32_t>(dictionary.size());
  if (version == 1)
    bytes += {static_cast<char>(length & 0xffu), static_cast<char>(length >> 8)};
  else
    append(bytes, length);
  return bytes + dictionary + values;
}
std::string dictionary(const std::string& type, const std::string& shape, const std::string& fortran = "False") {
  return "{'descr': " + type + ", 'fortran_order': " + fortran + ", 'shape': " + shape + ", }  \n";
}

class NpyFiles {
 public:
  build::Result<tools::QueryBatch> read(const std::string& bytes, QueryShape shape) const {
    return tools::read_queries(folder_.write("a.npy", bytes), shape);
  }
  std::string message(const std::string& bytes, QueryShape shape = QueryShape::kPoint) const {
    const auto refused = read(bytes, shape);
    REQUIRE(!refused);
    CHECK(refused.error().code == build::ErrorCode::kInvalidInput);
    CHECK_THAT(refused.error().message, Contains("a.npy: "));
    return refused.error().message;
  }

 private:
  TempFolder folder_;
};

template <class Value> std::string swapped(Value value) {
  std::string bytes;
  append(bytes, value);
  return {bytes.rbegin(), bytes.rend()};
}

}  // namespace

TEST_CASE("Arrays of numpy: both types, byte orders, index orders and all versions give the same queries") {
  const NpyFiles files;
  const std::vector<float> expected{1, -0.0f, 3.5f, 4, 1e-40f, std::numeric_limits<float>::infinity()};
  std::string singles, doubles, big, columns;
  for (const float x : expected) {
    append(singles, x);
    append(doubles, static_cast<double>(x));
    big += swapped(static_cast<double>(x));
  }
  for (std::size_t column = 0; column < 3; ++column)
    for (std::size_t row = 0; row < 2; ++row) columns += swapped(expected[3 * row + column]);
  for (const char version : {'\1', '\2', '\3'})
    for (const std::string& bytes :
         {npy(dictionary("'<f4'", "(2, 3)"), singles, version), npy(dictionary("'<f8'", "(2, 3)"), doubles, version),
          npy(dictionary("\">f8\"", "(2,3,)"), big, version),
          npy(dictionary("'>f4'", "( 2 , 3 )", "True"), columns, version),
          npy("{ \"shape\":(2,3),'descr':'<f4','fortran_order':False}", singles, version)}) {
      const auto batch = files.read(bytes, QueryShape::kPoint);
      INFO((batch ? std::string() : batch.error().message));
      REQUIRE(batch);
      CHECK((batch->size() == 2 && batch->values == expected && std::signbit(batch->values[1])));
    }
  CHECK(files.read(npy(dictionary("'<f8'", "(0, 4)"), ""), QueryShape::kSphere)->size() == 0);
}

TEST_CASE("Arrays of numpy: boxes of float64 are rounded outwards, points to the nearest") {
  const NpyFiles files;
  const double third = 1.0 / 3.0, huge = 1e300;
  std::string bytes;
  append(bytes, third, -third, huge, third, -third, huge);
  const auto boxes = files.read(npy(dictionary("'<f8'", "(1, 6)"), bytes), QueryShape::kBox);
  REQUIRE(boxes);
  const float above = static_cast<float>(third), below = std::nextafter(above, 0.0f);
  REQUIRE((double{below} < third && third < double{above}));
  CHECK(boxes->values == std::vector<float>{below, -above, std::numeric_limits<float>::max(), above, -below,
                                            std::numeric_limits<float>::infinity()});
  const auto points = files.read(npy(dictionary("'<f8'", "(2, 3)"), bytes), QueryShape::kPoint);
  CHECK((points->values[0] == above && points->values[1] == -above));
}

TEST_CASE("Arrays of numpy: other types and shapes are refused, with what was expected") {
  const NpyFiles files;
  const std::string twelve(12, '\0');
  CHECK_THAT(files.message(npy(dictionary("'<i4'", "(1, 3)"), twelve)),
             Contains("type '<i4'") && Contains("float32 or float64") && Contains("astype"));
  for (const char* type : {"'<f2'", "'|O'", "'<f16'", "'f4'", "'=f4'", "''", "'<c8'"})
    CHECK_THAT(files.message(npy(dictionary(type, "(1, 3)"), twelve)), Contains("expected float32 or float64"));
  CHECK_THAT(files.message(npy(dictionary("[('x', '<f4', (3,)), ('(]', '<f4')]", "(1,)"), twelve)),
             Contains("a structured array"));
  CHECK_THAT(files.message(npy(dictionary("'<f4'", "(3,)"), twelve)),
             Contains("shape (3,), a file of points has (n, 3)"));
  CHECK_THAT(files.message(npy(dictionary("'<f4'", "()"), twelve)), Contains("shape ()"));
  CHECK_THAT(files.message(npy(dictionary("'<f4'", "(1, 3, 1)"), twelve)), Contains("shape (1, 3, 1)"));
  CHECK_THAT(files.message(npy(dictionary("'<f4'", "(1, 3)"), twelve), QueryShape::kBox), Contains("boxes has (n, 6)"));
  CHECK_THAT(files.message(npy(dictionary("'<f4'", "(1, 3)"), twelve + "x")),
             Contains("takes 12 bytes") && Contains("has 13"));
  CHECK_THAT(files.message(npy(dictionary("'<f8'", "(1, 3)"), twelve)),
             Contains("takes 24 bytes") && Contains("has 12"));
  CHECK_THAT(files.message(npy(dictionary("'<f4'", "(4294967296, 3)"), twelve)), Contains("4294967296 points"));
  CHECK_THAT(files.message(npy(dictionary("'<f4'", "(18446744073709551615, 3)"), twelve)), Contains("at most"));
  CHECK_THAT(files.message(npy(dictionary("'<f4'", "(4294967295, 3)"), twelve)), Contains("51539607540 bytes"));
}

TEST_CASE("Arrays of numpy: hostile headers are refused with the byte") {
  const NpyFiles files;
  const std::string good = npy(dictionary("'<f4'", "(1, 3)"), std::string(12, '\0'));
  CHECK_THAT(files.message("x"), Contains("byte 0: a .npy file begins with"));
  for (std::size_t size = 1; size < good.size(); ++size) files.message(good.substr(0, size));
  CHECK_THAT(files.message(good.substr(0, 9)), Contains("9 bytes are too few"));
  CHECK_THAT(files.message(good.substr(0, 40)), Contains("byte 8") && Contains("only 30 follow"));
  std::string version = good;
  version[6] = 9;
  CHECK_THAT(files.message(version), Contains("byte 6: version 9.0"));
  const auto refuse = [&](const std::string& text, const std::string& expected) {
    CHECK_THAT(files.message(npy(text, std::string(12, '\0'))), Contains(expected));
  };
  refuse("", "byte 10 of the .npy header: expected '{', found its end");
  refuse("{", "a key in quotes, or '}'");
  refuse("{'descr'", "expected ':'");
  refuse("{'descr: '<f4'}", "expected ':'");
  refuse("{'size': 3}", "one of the keys");
  refuse("{'descr': '<f4', 'descr': '<f4'}", "no second 'descr'");
  refuse("{'descr': 3}", "byte 20 of the .npy header: expected a type in quotes or a list of fields, found '3}'");
  refuse("{'descr': [('x', '<f4')", "a list of fields");
  refuse("{'descr': [)]]}", "',' or '}'");
  refuse("{'fortran_order': 1}", "True or False");
  refuse("{'shape': 3}", "a tuple of numbers");
  refuse("{'shape': (3L, 3)}", "a tuple of numbers");
  refuse("{'shape': (-1, 3)}", "a tuple of numbers");
  refuse("{'shape': (18446744073709551616, 3)}", "a tuple of numbers below 2^64");
  refuse("{'shape': (1, 3) 'descr': '<f4'}", "',' or '}'");
  refuse("{'shape': (1, 3), 'descr': '<f4'}", "no 'fortran_order'");
  refuse("{'shape': (1, 3), 'fortran_order': False}", "no 'descr'");
  refuse("{'descr': '<f4', 'fortran_order': False}", "no 'shape'");
  refuse(dictionary("'<f4'", "(1, 3)") + "x", "the end of the header, found 'x'");
  refuse(std::string("{\0\x01", 3), R"(found '?)"
                                    R"(?')");
}

TEST_CASE("Arrays of numpy: what is written begins at a multiple of 64 bytes and has the fields of records") {
  const TempFolder folder;
  const std::vector<std::uint32_t> numbers{5, 6, 7};
  const auto written = [&](const char* type, const std::vector<std::uint64_t>& shape) {
    const std::string bytes = read_file(folder / "r.npy");
    const auto header = tools::read_npy_header("r.npy", std::as_bytes(std::span{bytes}));
    REQUIRE(header);
    CHECK(header->values % 64 == 0);
    CHECK(header->type == type);
    CHECK((header->shape == shape && !header->fortran_order));
    return bytes.substr(header->values);
  };
  const auto records = std::as_bytes(std::span{numbers});
  std::string expected;
  REQUIRE(
      tools::write_npy_results(folder / "r.npy", tools::NpyRecord::kNumber, std::array<std::uint64_t, 1>{3}, records));
  append(expected, 5u, 6u, 7u);
  CHECK(written("<u4", {3}) == expected);
  const std::vector<std::uint64_t> first{0, 2, 2, 3};
  REQUIRE(tools::write_npy_lists(folder / "r.npy", tools::NpyRecord::kNumber, first, records));
  expected.clear();
  append(expected, 0u, 5u, 0u, 6u, 2u, 7u);
  CHECK(written("[('query', '<u4'), ('primitive', '<u4')]", {3}) == expected);
  const tools::PointRecord point{1, 2, 3, 4, 0.25f, 0.5f, 8, 1};
  REQUIRE(tools::write_npy_results(folder / "r.npy", tools::NpyRecord::kPoint, std::array<std::uint64_t, 2>{1, 1},
                                   std::as_bytes(std::span{&point, 1})));
  expected.clear();
  append(expected, 1.0f, 2.0f, 3.0f, 4.0f, 0.25f, 0.5f, 8u, 1u);
  CHECK(written("[('distance', '<f4'), ('point', '<f4', (3,)), ('u', '<f4'), ('v', '<f4'), ('primitive', '<u4'), "
                "('feature', '<u4')]",
                {1, 1}) == expected);
  CHECK(folder.names() == std::vector<std::string>{"r.npy"});
}
