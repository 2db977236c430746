#pragma once
/// Values of a JSON document, and their locations for messages: "groups.forest[17].matrix".

#include <nlohmann/json_fwd.hpp>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace hiprt::tools {

/// Where a value is: a chain from it to the document, made on the stack while values are visited.
class JsonLocation {
 public:
  JsonLocation() = default;
  JsonLocation(const JsonLocation& outer, std::string_view key) : outer_(&outer), key_(key) {}
  JsonLocation(const JsonLocation& outer, std::size_t index) : outer_(&outer), index_(index), in_array_(true) {}

  /// "the document", or keys and indices.
  std::string text() const;

 private:
  const JsonLocation* outer_ = nullptr;
  std::string_view key_;
  std::size_t index_ = 0;
  bool in_array_ = false;
};

/// A message with the location. Readers of documents catch it.
struct JsonFault {
  std::string message;
};

[[noreturn]] void json_fault(const JsonLocation& location, const std::string& what);

/// Text of an exception of nlohmann's parser for messages: without its number, at most 200 characters. It says
/// "truncated" of a text that ends too early.
std::string parser_text(std::string_view text);

/// The document of a text. Throws JsonFault: it is no JSON, a key is there twice, or values nest deeper than
/// @p most_levels.
nlohmann::json parse_json(std::string_view text, std::size_t most_levels);

/// Each checks the kind of a value and throws JsonFault.
const nlohmann::json& json_object(const JsonLocation& location, const nlohmann::json& value);
const nlohmann::json& json_array(const JsonLocation& location, const nlohmann::json& value);
const std::string& json_string(const JsonLocation& location, const nlohmann::json& value);
double json_number(const JsonLocation& location, const nlohmann::json& value);
/// A member of an object. @param location of the object. Throws JsonFault if it is missing.
const nlohmann::json& json_required(const JsonLocation& location, const nlohmann::json& object, const char* key);
/// An integer from 0 to 4294967295.
std::uint32_t json_uint32(const JsonLocation& location, const nlohmann::json& value);
/// Fills @p numbers, and takes no other count.
void json_numbers(const JsonLocation& location, const nlohmann::json& value, double* numbers, std::size_t count);

template <std::size_t N> std::array<double, N> json_numbers(const JsonLocation& location, const nlohmann::json& value) {
  std::array<double, N> numbers{};
  json_numbers(location, value, numbers.data(), N);
  return numbers;
}

}  // namespace hiprt::tools
