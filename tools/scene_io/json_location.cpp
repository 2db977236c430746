#include <tools/scene_io/json_location.h>

#include <tools/base/text.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>
#include <vector>

namespace hiprt::tools {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMostShown = 40;

std::string as_written(std::string_view text) {
  return shortened(Json(text).dump(-1, ' ', false, Json::error_handler_t::replace), kMostShown);
}

[[noreturn]] void unexpected(const JsonLocation& location, const Json& value, const std::string& expected) {
  std::string found;
  if (value.is_object())
    found = "an object";
  else if (value.is_array())
    found = "an array";
  else
    found = shortened(value.dump(-1, ' ', false, Json::error_handler_t::replace), kMostShown);
  json_fault(location, found + ", " + expected + " expected");
}

/// Names that need no quotes.
bool plain(std::string_view key) {
  return !key.empty() && std::all_of(key.begin(), key.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '$';
  });
}

/// Asked at every event of the parser, which itself takes the last of equal keys and any depth.
class Guard {
 public:
  explicit Guard(std::size_t most_levels) : most_levels_(most_levels) {}

  bool operator()(int, Json::parse_event_t event, const Json& parsed) {
    if (event == Json::parse_event_t::object_start || event == Json::parse_event_t::array_start) {
      if (keys_.size() == most_levels_)
        throw JsonFault{"values nest deeper than " + std::to_string(most_levels_) + " levels"};
      keys_.emplace_back();
    } else if (event == Json::parse_event_t::object_end || event == Json::parse_event_t::array_end) {
      keys_.pop_back();
    } else if (event == Json::parse_event_t::key) {
      const auto& key = parsed.get_ref<const std::string&>();
      if (!keys_.back().insert(key).second) throw JsonFault{"an object has the key " + as_written(key) + " twice"};
    }
    return true;
  }

 private:
  std::size_t most_levels_;
  std::vector<std::set<std::string>> keys_;  ///< Of the objects that are open.
};

}  // namespace

std::string parser_text(std::string_view text) {
  constexpr std::size_t kMost = 200;
  const std::size_t begin = text.find("] ");
  std::string result = shortened(begin == std::string_view::npos ? text : text.substr(begin + 2), kMost);
  if (text.find("unexpected end of input") != std::string_view::npos) result.insert(0, "truncated: ");
  return result;
}

std::string JsonLocation::text() const {
  if (outer_ == nullptr) return "the document";
  std::string outer = outer_->outer_ == nullptr ? std::string() : outer_->text();
  if (in_array_) return outer + "[" + std::to_string(index_) + "]";
  if (!plain(key_)) return outer + "[" + as_written(key_) + "]";
  return outer + (outer.empty() ? "" : ".") + std::string(key_);
}

void json_fault(const JsonLocation& location, const std::string& what) {
  throw JsonFault{location.text() + ": " + what};
}

nlohmann::json parse_json(std::string_view text, std::size_t most_levels) {
  if (is_utf16(text)) throw JsonFault{kUtf16Fault};
  skip_byte_order_mark(text);
  Guard guard(most_levels);
  try {
    return Json::parse(text,
                       [&](int depth, Json::parse_event_t event, Json& parsed) { return guard(depth, event, parsed); });
  } catch (const Json::exception& error) {
    throw JsonFault{parser_text(error.what())};
  }
}

const nlohmann::json& json_object(const JsonLocation& location, const nlohmann::json& value) {
  if (!value.is_object()) unexpected(location, value, "an object");
  return value;
}

const nlohmann::json& json_array(const JsonLocation& location, const nlohmann::json& value) {
  if (!value.is_array()) unexpected(location, value, "an array");
  return value;
}

const std::string& json_string(const JsonLocation& location, const nlohmann::json& value) {
  if (!value.is_string()) unexpected(location, value, "a string");
  return value.get_ref<const std::string&>();
}

const nlohmann::json& json_required(const JsonLocation& location, const nlohmann::json& object, const char* key) {
  const auto value = object.find(key);
  if (value == object.end()) json_fault(location, std::string("'") + key + "' is missing");
  return *value;
}

double json_number(const JsonLocation& location, const nlohmann::json& value) {
  if (!value.is_number()) unexpected(location, value, "a number");
  return value.get<double>();
}

std::uint32_t json_uint32(const JsonLocation& location, const nlohmann::json& value) {
  // JSON has one kind of numbers: 1.0 is an integer.
  const double number = value.is_number() ? value.get<double>() : -1.0;
  if (!(number >= 0.0 && number <= 4294967295.0 && number == std::floor(number)))
    unexpected(location, value, "an integer from 0 to 4294967295");
  return static_cast<std::uint32_t>(number);
}

void json_numbers(const JsonLocation& location, const nlohmann::json& value, double* numbers, std::size_t count) {
  json_array(location, value);
  if (value.size() != count)
    json_fault(location, std::to_string(value.size()) + " numbers, " + std::to_string(count) + " expected");
  for (std::size_t i = 0; i < count; ++i) numbers[i] = json_number(JsonLocation(location, i), value[i]);
}

}  // namespace hiprt::tools
