/// Trees as JSON: values are read back bit for bit. Errors name their position in the file.

#include "temp_folder.h"

#include <tests/exchange/trees.h>
#include <tools/scene_io/exchange_json.h>

#include <tests/catch.h>
#include <nlohmann/json.hpp>

#include <bit>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

namespace {

constexpr std::uint64_t kSeed = 12;

const std::string kGood = R"({"format": "hiprt exchange bvh", "version": 1,
  "nodes": [{"min": [0, -1, 0.5], "max": [2, 1e1, 0.5], "children": [1, 2]},
            {"min": [0, 0, 0.5], "max": [1, 1, 0.5], "primitives": [0, 1]},
            {"max": [2, 1, 0.5], "primitives": [1, 3], "min": [1, 0, 0.5]}],
  "primitives": [2, 0, 3, 1]})";

build::Result<ExchangeBvh> read(const std::string& text) {
  const TempFolder folder;
  return tools::read_exchange(folder.write("t.json", text));
}

/// The error message for a text, after the path.
std::string refusal(const std::string& text) {
  const auto tree = read(text);
  if (tree) return "";
  CHECK(tree.error().code == build::ErrorCode::kInvalidInput);
  const std::size_t at = tree.error().message.find("t.json: ");
  REQUIRE(at != std::string::npos);
  CHECK(tree.error().message.find('\n') == std::string::npos);
  return tree.error().message.substr(at + 8);
}

/// The refusal of kGood with a part replaced.
std::string replaced(const std::string& part, const std::string& with) {
  std::string text = kGood;
  const std::size_t at = text.find(part);
  REQUIRE(at != std::string::npos);
  return refusal(text.replace(at, part.size(), with));
}

float any_finite(oracle::Random& random) {
  for (;;)
    if (const float value = random.any_float(); std::isfinite(value)) return value;
}

}  // namespace

TEST_CASE("Exchange JSON: a file written by hand") {
  const auto tree = read(kGood);
  REQUIRE(tree.has_value());
  const ExchangeBvh expected{{{{{0, -1, 0.5f}, {2, 10, 0.5f}}, 1, 2, 0},
                              {{{0, 0, 0.5f}, {1, 1, 0.5f}}, 0, 0, 1},
                              {{{1, 0, 0.5f}, {2, 1, 0.5f}}, 1, 0, 3}},
                             {2, 0, 3, 1}};
  CHECK(same(*tree, expected));
}

TEST_CASE("Exchange JSON: floats are read back bit for bit, also through double") {
  INFO("seed " << kSeed);
  const TempFolder folder;
  oracle::Random random(kSeed);
  ExchangeBvh tree;
  for (unsigned i = 0; i < 20000; ++i) {
    ExchangeNode node{};
    for (unsigned axis = 0; axis < 3; ++axis) {
      node.box.min[axis] = any_finite(random);
      node.box.max[axis] = random.coin() ? any_finite(random) : static_cast<float>(random.below(1000)) / 8;
    }
    node.first = static_cast<std::uint32_t>(random.bits());
    (random.coin() ? node.children : node.primitives) = 1 + random.below(0xffffffffu);
    tree.nodes.push_back(node);
    tree.primitives.push_back(static_cast<std::uint32_t>(random.bits()));
  }
  tree.nodes[0].box = {{0.0f, -0.0f, 0x1p-149f}, {-0x1p-149f, std::numeric_limits<float>::max(), 16777217.0f}};
  REQUIRE(tools::write_exchange(folder / "t.json", tree).has_value());
  const auto back = tools::read_exchange(folder / "t.json");
  REQUIRE(back.has_value());
  REQUIRE(same(*back, tree));
  const auto document = nlohmann::json::parse(read_file(folder / "t.json"));
  for (std::size_t i = 0; i < tree.nodes.size(); ++i)
    for (unsigned axis = 0; axis < 3; ++axis) {
      const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x); };
      const float low = tree.nodes[i].box.min[axis];
      REQUIRE(bits(back->nodes[i].box.min[axis]) == bits(low));
      REQUIRE(bits(static_cast<float>(document["nodes"][i]["min"][axis].get<double>())) == bits(low));
      REQUIRE(bits(back->nodes[i].box.max[axis]) == bits(tree.nodes[i].box.max[axis]));
    }
}

TEST_CASE("Exchange JSON: no nodes") {
  const TempFolder folder;
  REQUIRE(tools::write_exchange(folder / "t.json", {}).has_value());
  const auto back = tools::read_exchange(folder / "t.json");
  REQUIRE(back.has_value());
  CHECK(same(*back, {}));
}

TEST_CASE("Exchange JSON: missing, unknown, repeated and wrongly typed members are named") {
  CHECK(replaced("\"hiprt exchange bvh\"", "\"bvh\"") == "format is \"bvh\", not \"hiprt exchange bvh\"");
  CHECK(replaced("\"hiprt exchange bvh\"", "7") == "format is 7, expected is a string");
  CHECK(replaced("\"version\": 1", "\"version\": 2") == "version is 2, known is 1");
  CHECK(replaced("\"version\": 1", "\"version\": 1.5") == "version is 1.5, expected is an integer");
  CHECK(replaced("\"version\": 1", "\"version\": [1]") == "version is an array, expected is an integer");
  CHECK(replaced("\"version\": 1,", "") == "the document has no 'version'");
  CHECK(replaced("\"version\": 1", "\"depth\": 1") == "the document has the unknown key \"depth\"");
  CHECK(replaced("\"version\": 1", "\"version\": 1, \"version\": 1") == "the document has 'version' twice");
  CHECK(replaced("[2, 0, 3, 1]", "{}") == "primitives is an object, expected is an array");
  CHECK(replaced("[2, 0, 3, 1]", "[2, -1, 3]") == "primitives[1] is -1, expected is an integer from 0 to 4294967295");
  CHECK(replaced("[2, 0, 3, 1]", "[4294967296]") == "primitives[0] is 4294967296, the limit is 4294967295");
  CHECK(replaced("[2, 0, 3, 1]", "[1, [2]]") ==
        "primitives[1] is an array, expected is an integer from 0 to 4294967295");
  CHECK(replaced("[2, 0, 3, 1]", "[0.5]") == "primitives[0] is 0.5, expected is an integer from 0 to 4294967295");
  CHECK(replaced("\"min\": [0, 0, 0.5]", "\"min\": [0, null, 0.5]") == "nodes[1].min[1] is null, expected is a number");
  CHECK(replaced("\"min\": [0, 0, 0.5]", "\"min\": [0, 0]") == "nodes[1].min has 2 numbers, not 3");
  CHECK(replaced("\"min\": [0, 0, 0.5]", "\"min\": [0, 0, 0, 0]") == "nodes[1].min has more than 3 numbers");
  CHECK(replaced("\"min\": [0, 0, 0.5]", "\"min\": true") == "nodes[1].min is a truth value, expected is an array");
  CHECK(replaced("\"min\": [0, 0, 0.5], ", "") == "nodes[1] has no 'min'");
  CHECK(replaced("\"children\": [1, 2]", "\"children\": [1]") == "nodes[0].children has 1 numbers, not 2");
  CHECK(replaced("\"children\": [1, 2]", "\"children\": [1, 2, 3]") == "nodes[0].children has more than 2 numbers");
  CHECK(replaced(", \"children\": [1, 2]", "") == "nodes[0] has neither 'children' nor 'primitives'");
  CHECK(replaced("\"children\": [1, 2]", "\"children\": [1, 2], \"primitives\": [0, 1]") ==
        "nodes[0] has both 'children' and 'primitives'");
  CHECK(replaced("\"children\": [1, 2]", "\"children\": [1, \"x\"]") ==
        "nodes[0].children[1] is a string, expected is an integer from 0 to 4294967295");
  CHECK(replaced("\"version\": 1", "\"a\\n\": 1") == "the document has the unknown key \"a\\n\"");
  CHECK(refusal("5") == "the document is 5, expected is an object");
  CHECK(refusal("[]") == "the document is an array, expected is an object");
  CHECK(refusal("{\"nodes\": {}}") == "nodes is an object, expected is an array");
  CHECK(refusal("{\"nodes\": [{}]}") == "nodes[0] has no 'min'");
  CHECK(refusal("{\"nodes\": [[]]}") == "nodes[0] is an array, expected is an object");
  CHECK(refusal("{\"nodes\": [7]}") == "nodes[0] is 7, expected is an object");
}

TEST_CASE("Exchange JSON: text that is not JSON is refused with line and column") {
  CHECK_THAT(refusal(kGood.substr(0, kGood.size() - 1)), Contains("line 5, column") && Contains("unexpected end"));
  CHECK_THAT(refusal(kGood + "x"), Contains("line 5"));
  CHECK_THAT(replaced("0.5]", "0.5,]"), Contains("line 2"));
  CHECK_THAT(replaced("0.5]", "nan]"), Contains("line 2"));
  CHECK_THAT(replaced("1e1", "1e999"), Contains("1e999"));
  CHECK_FALSE(refusal(std::string(1000000, '[')).empty());
  CHECK_FALSE(refusal(std::string(100, '\0')).empty());
}

TEST_CASE("Exchange JSON: numbers beyond float become infinite, which the check of trees refuses") {
  const auto tree = read(std::string(kGood).replace(kGood.find("1e1"), 3, "1e39"));
  REQUIRE(tree.has_value());
  CHECK(std::isinf(tree->nodes[0].box.max[1]));
  const TempFolder folder;
  const auto refused = tools::write_exchange(folder / "t.json", *tree);
  REQUIRE_FALSE(refused.has_value());
  CHECK_THAT(refused.error().message, Contains("t.json: node 0 ") && Contains("not finite"));
  CHECK(folder.names().empty());
}

TEST_CASE("Exchange JSON: files that are missing, empty or cannot be written") {
  const TempFolder folder;
  CHECK(tools::read_exchange(folder / "none.json").error().code == build::ErrorCode::kIo);
  CHECK(tools::read_exchange(folder.write("empty.json", "")).error().code == build::ErrorCode::kIo);
  CHECK(tools::write_exchange(folder / "no/t.json", {}).error().code == build::ErrorCode::kIo);
  CHECK(folder.names() == std::vector<std::string>{"empty.json"});
}

TEST_CASE("Exchange JSON: damaged texts are read or refused") {
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  constexpr std::string_view kBytes = "{}[],:\"0123456789.-e \nnultrefasdm\\\x80";
  unsigned accepted = 0;
  for (unsigned i = 0; i < 600; ++i) {
    std::string text = kGood;
    for (unsigned changes = 1 + random.below(3); changes > 0; --changes) {
      const std::size_t at = random.below(static_cast<std::uint32_t>(text.size()));
      const char byte = kBytes[random.below(static_cast<std::uint32_t>(kBytes.size()))];
      if (random.coin())
        text[at] = byte;
      else
        random.coin() ? text.insert(at, 1, byte) : text.erase(at, 1 + random.below(8));
    }
    if (refusal(text).empty()) ++accepted;
  }
  CHECK(accepted > 10);
  CHECK(accepted < 500);
}
