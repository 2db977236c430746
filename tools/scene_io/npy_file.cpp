#include <tools/scene_io/npy_file.h>

#include <tools/base/errors.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>

namespace hiprt::tools {
namespace {

constexpr std::string_view kMagic = "\x93NUMPY";
constexpr std::size_t kBeforeLength = 8;  ///< Magic and version.
constexpr std::size_t kAlignment = 64;

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Reads the dictionary of a header.
class DictionaryReader {
 public:
  /// @param begin, end of the dictionary in the file.
  DictionaryReader(std::string name, std::string_view file, std::size_t begin, std::size_t end)
      : name_(std::move(name)), file_(file.substr(0, end)), at_(begin) {}

  build::Result<NpyHeader> read() {
    NpyHeader header;
    if (!take('{')) return wrong("'{'");
    while (!take('}')) {
      const auto key = quoted();
      if (!key) return wrong("a key in quotes, or '}'");
      if (!take(':')) return wrong("':'");
      if (const std::string expected = read_value(*key, header); !expected.empty()) return wrong(expected);
      if (!take(',') && !next_is('}')) return wrong("',' or '}'");
    }
    skip_blanks();
    if (at_ != file_.size()) return wrong("the end of the header");
    for (const auto& [key, seen] : seen_)
      if (!seen) return invalid_input(name_ + ": the header has no '" + std::string(key) + "'");
    return header;
  }

 private:
  struct Key {
    std::string_view name;
    bool seen = false;
  };

  /// @return what was expected, if something else is there.
  std::string read_value(std::string_view key, NpyHeader& header) {
    const auto known = std::ranges::find(seen_, key, &Key::name);
    if (known == seen_.end()) return "one of the keys 'descr', 'fortran_order' and 'shape' before the ':'";
    if (known->seen) return "no second '" + std::string(key) + "'";
    known->seen = true;
    if (key == "descr") return read_type(header) ? "" : "a type in quotes or a list of fields";
    if (key == "shape") return read_shape(header.shape) ? "" : "a tuple of numbers below 2^64";
    skip_blanks();
    for (const std::string_view word : {"True", "False"}) {
      if (!file_.substr(at_).starts_with(word)) continue;
      at_ += word.size();
      header.fortran_order = word == "True";
      return "";
    }
    return "True or False";
  }
  bool read_type(NpyHeader& header) {
    if (next_is('[')) return read_fields(header);
    const auto type = quoted();
    if (type) header.type = *type;
    return type.has_value();
  }
  /// Skips a list to its last bracket.
  bool read_fields(NpyHeader& header) {
    const std::size_t begin = at_;
    std::size_t open = 0;
    do {
      skip_blanks();
      if (at_ == file_.size()) return false;
      const char c = file_[at_];
      if (c == '\'' || c == '"') {
        if (!quoted()) return false;
        continue;
      }
      open += c == '[' || c == '(' ? 1 : 0;
      open -= c == ']' || c == ')' ? 1 : 0;
      ++at_;
    } while (open != 0);
    header.is_structured = true;
    header.type = file_.substr(begin, at_ - begin);
    return true;
  }
  bool read_shape(std::vector<std::uint64_t>& shape) {
    if (!take('(')) return false;
    while (!take(')')) {
      const auto number = read_number();
      if (!number) return false;
      shape.push_back(*number);
      if (!take(',') && !next_is(')')) return false;
    }
    return true;
  }
  std::optional<std::uint64_t> read_number() {
    skip_blanks();
    const std::size_t begin = at_;
    std::uint64_t value = 0;
    for (; at_ < file_.size() && file_[at_] >= '0' && file_[at_] <= '9'; ++at_) {
      const auto digit = static_cast<std::uint64_t>(file_[at_] - '0');
      if (value > (std::numeric_limits<std::uint64_t>::max() - digit) / 10) return std::nullopt;
      value = 10 * value + digit;
    }
    return at_ == begin ? std::nullopt : std::optional(value);
  }
  std::optional<std::string_view> quoted() {
    skip_blanks();
    if (at_ == file_.size() || (file_[at_] != '\'' && file_[at_] != '"')) return std::nullopt;
    const std::size_t begin = at_ + 1, end = file_.find(file_[at_], begin);
    if (end == std::string_view::npos) return std::nullopt;
    at_ = end + 1;
    return file_.substr(begin, end - begin);
  }
  void skip_blanks() {
    while (at_ < file_.size() && (file_[at_] == ' ' || file_[at_] == '\n' || file_[at_] == '\t')) ++at_;
  }
  bool next_is(char c) {
    skip_blanks();
    return at_ < file_.size() && file_[at_] == c;
  }
  bool take(char c) {
    const bool is_there = next_is(c);
    at_ += is_there ? 1 : 0;
    return is_there;
  }
  tl::unexpected<build::Error> wrong(const std::string& expected) const {
    std::string found = at_ == file_.size() ? "its end" : "'" + std::string(file_.substr(at_, 12)) + "'";
    for (char& c : found)
      if (c < ' ' || c > '~') c = '?';
    return invalid_input(name_ + ": byte " + std::to_string(at_) + " of the .npy header: expected " + expected +
                         ", found " + found);
  }

  std::string name_;
  std::string_view file_;
  std::size_t at_;
  std::array<Key, 3> seen_{{{"descr"}, {"fortran_order"}, {"shape"}}};
};

}  // namespace

bool is_npy_name(const std::filesystem::path& path) { return path.extension() == ".npy"; }

bool is_npy(std::span<const std::byte> bytes) { return text_of(bytes).starts_with(kMagic); }

build::Result<NpyHeader> read_npy_header(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  const std::string name = path.string();
  const std::string_view file = text_of(bytes);
  if (!is_npy(bytes)) return invalid_input(name + ": byte 0: a .npy file begins with \\x93NUMPY, this one does not");
  const std::size_t length_bytes = file.size() > 6 && file[6] == 1 ? 2 : 4;
  if (file.size() < kBeforeLength + length_bytes)
    return invalid_input(name + ": " + std::to_string(file.size()) +
                         " bytes are too few for the header of a .npy file");
  if (file[6] < 1 || file[6] > 3 || file[7] != 0)
    return invalid_input(name + ": byte 6: version " + std::to_string(int{static_cast<unsigned char>(file[6])}) + "." +
                         std::to_string(int{static_cast<unsigned char>(file[7])}) +
                         " of .npy, known are 1.0, 2.0 and 3.0");
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + kBeforeLength, length_bytes);
  const std::size_t begin = kBeforeLength + length_bytes;
  if (length > file.size() - begin)
    return invalid_input(name + ": byte 8: the .npy header has " + std::to_string(length) + " bytes, but only " +
                         std::to_string(file.size() - begin) + " follow: the file is truncated");
  auto header = DictionaryReader(name, file, begin, begin + length).read();
  if (header) header->values = begin + length;
  return header;
}

std::string shape_text(std::span<const std::uint64_t> shape) {
  std::string text = "(";
  for (std::size_t i = 0; i < shape.size(); ++i) text += (i == 0 ? "" : ", ") + std::to_string(shape[i]);
  return text + (shape.size() == 1 ? ",)" : ")");
}

std::string npy_header(std::string_view type, std::span<const std::uint64_t> shape) {
  std::string text =
      "{'descr': " + std::string(type) + ", 'fortran_order': False, 'shape': " + shape_text(shape) + ", }";
  const std::size_t before = kBeforeLength + 2;
  text.resize((before + text.size() + 1 + kAlignment - 1) / kAlignment * kAlignment - before - 1, ' ');
  text += '\n';
  const auto length = static_cast<std::uint16_t>(text.size());
  std::string result(kMagic);
  result += {'\1', '\0', static_cast<char>(length & 0xff), static_cast<char>(length >> 8)};
  return result + text;
}

}  // namespace hiprt::tools
