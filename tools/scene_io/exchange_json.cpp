#include <tools/scene_io/exchange_json.h>

#include <tools/base/memory_limit.h>
#include <tools/base/read_input.h>
#include <tools/base/text.h>
#include <tools/scene_io/json_location.h>

#include <hiprt_build/file.h>

#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <new>

namespace hiprt::tools {
namespace {

constexpr std::string_view kFormatName = "hiprt exchange bvh";
constexpr std::uint64_t kKnownVersion = 1;

/// Where the parser is: in the value of this name, or in the document.
enum class Place {
  kOutside,
  kDocument,
  kNodes,
  kNode,
  kMin,
  kMax,
  kChildren,
  kNodePrimitives,
  kEntries,
  kFormat,
  kVersion
};

struct Key {
  const char* name;
  Place location;
};
constexpr std::array<Key, 4> kDocumentKeys{{{"format", Place::kFormat},
                                            {"version", Place::kVersion},
                                            {"nodes", Place::kNodes},
                                            {"primitives", Place::kEntries}}};
constexpr std::array<Key, 4> kNodeKeys{{{"min", Place::kMin},
                                        {"max", Place::kMax},
                                        {"children", Place::kChildren},
                                        {"primitives", Place::kNodePrimitives}}};

/// Takes the parser's events, so that a document is never in memory as a whole.
class Reader {
 public:
  using Json = nlohmann::json;

  build::ExchangeBvh take() { return std::move(tree_); }
  const std::string& error() const { return error_; }

  bool null() { return unexpected("null"); }
  bool boolean(bool) { return unexpected("a truth value"); }
  bool binary(Json::binary_t&) { return unexpected("bytes"); }
  bool number_integer(Json::number_integer_t value) {
    return is_box() ? plane(static_cast<float>(value)) : unexpected(std::to_string(value));
  }
  bool number_unsigned(Json::number_unsigned_t value) {
    return is_box() ? plane(static_cast<float>(value)) : integer(value);
  }
  bool number_float(Json::number_float_t, const Json::string_t& text) {
    return is_box() ? plane(parse_real<float>(text).value_or(NAN)) : unexpected(text);
  }
  bool string(Json::string_t& text) {
    if (location_ != Place::kFormat) return unexpected("a string");
    if (text != kFormatName) return fail("is " + quoted(text) + ", not " + quoted(std::string(kFormatName)));
    return leave(Place::kDocument);
  }

  bool start_object(std::size_t) {
    if (location_ == Place::kOutside) return enter(Place::kDocument);
    if (location_ != Place::kNodes || !in_array_) return unexpected("an object");
    tree_.nodes.emplace_back();
    node_keys_ = 0;
    in_array_ = false;
    return enter(Place::kNode);
  }
  bool key(Json::string_t& name) {
    const bool in_node = location_ == Place::kNode;
    const auto& keys = in_node ? kNodeKeys : kDocumentKeys;
    unsigned& seen = in_node ? node_keys_ : document_keys_;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      if (name != keys[i].name) continue;
      if ((seen >> i & 1u) != 0) return fail("has " + in_quotes(name) + " twice");
      seen |= 1u << i;
      return enter(keys[i].location);
    }
    return fail("has the unknown key " + quoted(name));
  }
  bool end_object() {
    if (location_ == Place::kDocument) {
      for (std::size_t i = 0; i < kDocumentKeys.size(); ++i)
        if ((document_keys_ >> i & 1u) == 0) return fail(std::string("has no '") + kDocumentKeys[i].name + "'");
      return leave(Place::kOutside);
    }
    for (std::size_t i = 0; i < 2; ++i)
      if ((node_keys_ >> i & 1u) == 0) return fail(std::string("has no '") + kNodeKeys[i].name + "'");
    if (node_keys_ >> 2 == 0) return fail("has neither 'children' nor 'primitives'");
    if (node_keys_ >> 2 == 3) return fail("has both 'children' and 'primitives'");
    return leave(Place::kNodes);
  }

  bool start_array(std::size_t) {
    const bool takes = location_ >= Place::kNodes && location_ != Place::kNode && location_ <= Place::kEntries;
    if (!takes || in_array_) return unexpected("an array");
    in_array_ = true;
    index_ = 0;
    return true;
  }
  bool end_array() {
    const std::size_t wanted = is_box() ? 3 : is_range() ? 2 : index_;
    if (index_ != wanted)
      return fail("has " + std::to_string(index_) + " numbers, not " + std::to_string(wanted), false);
    return leave(location_ == Place::kNodes || location_ == Place::kEntries ? Place::kDocument : Place::kNode);
  }

  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception& exception) {
    error_ = parser_text(exception.what());
    return false;
  }

 private:
  bool is_box() const { return in_array_ && (location_ == Place::kMin || location_ == Place::kMax); }
  bool is_range() const { return in_array_ && (location_ == Place::kChildren || location_ == Place::kNodePrimitives); }

  bool enter(Place location) {
    location_ = location;
    return true;
  }
  bool leave(Place outer) {
    in_array_ = outer == Place::kNodes;
    return enter(outer);
  }

  bool plane(float value) {
    if (index_ >= 3) return fail("has more than 3 numbers", false);
    Box& box = tree_.nodes.back().box;
    (location_ == Place::kMin ? box.min : box.max)[index_++] = value;
    return true;
  }

  bool integer(std::uint64_t value) {
    if (location_ == Place::kVersion) {
      if (value != kKnownVersion)
        return fail("is " + std::to_string(value) + ", known is " + std::to_string(kKnownVersion));
      return leave(Place::kDocument);
    }
    const bool entry = in_array_ && location_ == Place::kEntries;
    if (!entry && !is_range()) return unexpected(std::to_string(value));
    if (value > 0xffffffffu) return fail("is " + std::to_string(value) + ", the limit is 4294967295");
    if (entry)
      tree_.primitives.push_back(static_cast<std::uint32_t>(value));
    else if (!range(static_cast<std::uint32_t>(value)))
      return fail("has more than 2 numbers", false);
    ++index_;
    return true;
  }
  bool range(std::uint32_t value) {
    build::ExchangeNode& node = tree_.nodes.back();
    if (index_ == 0) node.first = value;
    if (index_ == 1) (location_ == Place::kChildren ? node.children : node.primitives) = value;
    return index_ < 2;
  }

  /// As JSON writes it, cut to a sane length.
  static std::string quoted(const std::string& text) { return shortened(Json(text).dump(), 40); }
  /// @param element false: the error is of the whole array.
  std::string location_text(bool element) const {
    std::string node = "nodes[" + std::to_string(tree_.nodes.size() - 1) + "]";
    const std::string at = in_array_ && element ? "[" + std::to_string(index_) + "]" : "";
    switch (location_) {
      case Place::kOutside:
      case Place::kDocument:
        return "the document";
      case Place::kNodes:
        return in_array_ ? "nodes[" + std::to_string(tree_.nodes.size()) + "]" : "nodes";
      case Place::kNode:
        return node;
      case Place::kEntries:
        return "primitives" + at;
      case Place::kFormat:
        return "format";
      case Place::kVersion:
        return "version";
      default:
        return node + "." +
               kNodeKeys[static_cast<std::size_t>(location_) - static_cast<std::size_t>(Place::kMin)].name + at;
    }
  }
  bool fail(const std::string& what, bool element = true) {
    error_ = location_text(element) + " " + what;
    return false;
  }
  bool unexpected(const std::string& what) { return fail("is " + shortened(what, 40) + ", expected is " + expected()); }
  const char* expected() const {
    switch (location_) {
      case Place::kOutside:
        return "an object";
      case Place::kNodes:
        return in_array_ ? "an object" : "an array";
      case Place::kFormat:
        return "a string";
      case Place::kVersion:
        return "an integer";
      default:
        return !in_array_ ? "an array" : is_box() ? "a number" : "an integer from 0 to 4294967295";
    }
  }

  build::ExchangeBvh tree_;
  std::string error_;
  Place location_ = Place::kOutside;
  bool in_array_ = false;                       ///< Between the brackets of place_.
  std::size_t index_ = 0;                       ///< Numbers so far in the innermost array.
  unsigned document_keys_ = 0, node_keys_ = 0;  ///< Bit i: key i was there.
};

void append(std::string& text, std::uint32_t value) {
  std::array<char, 16> digits{};
  text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
}

void append(std::string& text, float value) {
  // JSON readers take -0 for the integer 0.
  if (value == 0.0f && std::signbit(value)) {
    text += "-0.0";
    return;
  }
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::general, 9);
  text.append(digits.data(), end.ptr);
}

void append(std::string& text, const float (&corner)[3]) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    text += axis == 0 ? "[" : ", ";
    append(text, corner[axis]);
  }
  text += "]";
}

void append(std::string& text, const build::ExchangeNode& node) {
  text += "{\"min\": ";
  append(text, node.box.min);
  text += ", \"max\": ";
  append(text, node.box.max);
  text += node.children != 0 ? ", \"children\": [" : ", \"primitives\": [";
  append(text, node.first);
  text += ", ";
  append(text, node.children != 0 ? node.children : node.primitives);
  text += "]}";
}

std::string to_json(const build::ExchangeBvh& tree) {
  constexpr std::size_t kEntriesPerLine = 16;
  std::string text = "{\"format\": \"" + std::string(kFormatName) +
                     "\", \"version\": " + std::to_string(kKnownVersion) + ",\n\"nodes\": [";
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    text += i == 0 ? "\n" : ",\n";
    append(text, tree.nodes[i]);
  }
  text += "],\n\"primitives\": [";
  for (std::size_t i = 0; i < tree.primitives.size(); ++i) {
    text += i % kEntriesPerLine == 0 ? (i == 0 ? "\n" : ",\n") : ", ";
    append(text, tree.primitives[i]);
  }
  return text + "]}\n";
}

}  // namespace

build::Result<build::ExchangeBvh> read_exchange(const std::filesystem::path& path) try {
  const auto file = read_input(path);
  if (!file) return tl::unexpected(file.error());
  const char* begin = reinterpret_cast<const char*>(file->bytes().data());
  if (is_utf16({begin, file->size()}))
    return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput, path.string() + ": " + kUtf16Fault});
  Reader reader;
  if (!nlohmann::json::sax_parse(begin, begin + file->size(), &reader))
    return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput, path.string() + ": " + reader.error()});
  return reader.take();
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(not_enough_memory(path.native(), "to read it", failure));
}

build::Result<void> write_exchange(const std::filesystem::path& path, const build::ExchangeBvh& tree) {
  for (std::size_t i = 0; i < tree.nodes.size(); ++i)
    for (unsigned axis = 0; axis < 3; ++axis)
      if (!std::isfinite(tree.nodes[i].box.min[axis]) || !std::isfinite(tree.nodes[i].box.max[axis]))
        return tl::unexpected(build::Error{
            build::ErrorCode::kInvalidInput,
            path.string() + ": node " + std::to_string(i) + " has a box that is not finite, which JSON cannot hold"});
  const std::string text = to_json(tree);
  return build::write_file(path, std::as_bytes(std::span(text)));
}

}  // namespace hiprt::tools
