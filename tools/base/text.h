#pragma once
/// Numbers and words of text formats.

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

namespace hiprt::tools {

inline bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

/// Removes the first word from @p text and returns it, or nothing at the end. Words end at blanks. Line breaks are no
/// blanks.
inline std::string_view next_word(std::string_view& text) {
  std::size_t begin = 0;
  while (begin < text.size() && is_blank(text[begin])) ++begin;
  std::size_t end = begin;
  while (end < text.size() && !is_blank(text[end])) ++end;
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

/// Cuts the line break at the start of @p text off: LF, CR or CRLF. @return is there one?
inline bool skip_line_break(std::string_view& text) {
  const std::size_t size = text.starts_with("\r\n") ? 2 : text.starts_with('\n') || text.starts_with('\r') ? 1 : 0;
  text.remove_prefix(size);
  return size != 0;
}

/// Cuts the first word off @p text, over line breaks, which are added to @p line; empty at the end.
inline std::string_view next_word_of_lines(std::string_view& text, std::uint64_t& line) {
  while (!text.empty() && (is_blank(text.front()) || text.front() == '\n')) {
    if (skip_line_break(text))
      ++line;
    else
      text.remove_prefix(1);
  }
  std::size_t end = 0;
  while (end < text.size() && !is_blank(text[end]) && text[end] != '\n') ++end;
  const std::string_view word = text.substr(0, end);
  text.remove_prefix(end);
  return word;
}

/// Cuts the first line off @p text (without its line break: LF, CR or CRLF).
inline std::string_view next_line(std::string_view& text) {
  // One pass: in a file without LF, a search for each line's LF would take the square of its size.
  std::size_t end = 0;
  while (end < text.size() && text[end] != '\n' && text[end] != '\r') ++end;
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end);
  skip_line_break(text);
  return line;
}

/// Whether the name of a file ends in an extension such as ".png", in any case. @param extension in lower case.
inline bool has_extension(std::string_view path, std::string_view extension) {
  if (path.size() <= extension.size() || path[path.size() - extension.size() - 1] == '/') return false;
  path.remove_prefix(path.size() - extension.size());
  for (std::size_t i = 0; i < path.size(); ++i) {
    const char c = path[i] >= 'A' && path[i] <= 'Z' ? static_cast<char>(path[i] - 'A' + 'a') : path[i];
    if (c != extension[i]) return false;
  }
  return true;
}

/// Cuts a UTF-8 byte order mark off the start of a file's text.
inline void skip_byte_order_mark(std::string_view& text) {
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  if (text.starts_with(kMark)) text.remove_prefix(kMark.size());
}

/// What Microsoft's C library wrote for numbers that are not finite, of any count of digits: 1.#INF00, -1.#IND, 1.#J.
template <class Real> std::optional<Real> parse_not_finite(std::string_view word) {
  const bool negative = word.starts_with('-');
  if (negative || word.starts_with('+')) word.remove_prefix(1);
  if (!word.starts_with("1.#")) return std::nullopt;
  word.remove_prefix(3);
  while (word.ends_with('0')) word.remove_suffix(1);
  if (word == "INF") return negative ? -std::numeric_limits<Real>::infinity() : std::numeric_limits<Real>::infinity();
  for (const std::string_view name : {"IND", "QNAN", "SNAN", "J", "IO", "QO", "SO", "R"})
    if (word == name) return std::numeric_limits<Real>::quiet_NaN();
  return std::nullopt;
}

/// The line up to a comment, which begins with #. The # of 1.#IND begins none.
inline std::string_view without_comment(std::string_view line) {
  for (std::size_t at = line.find('#'); at != std::string_view::npos; at = line.find('#', at + 1)) {
    std::size_t begin = at;
    while (begin > 0 && !is_blank(line[begin - 1])) --begin;
    std::string_view word = line.substr(begin);
    if (!parse_not_finite<float>(next_word(word))) return line.substr(0, at);
  }
  return line;
}

/// @return whether a text begins as UTF-16 (or UTF-32) does: with its byte order mark, or a zero byte in each of the
/// first two characters.
inline bool is_utf16(std::string_view text) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) return true;
  if (text.size() < 4) return false;
  const auto zero = [&](std::size_t i) { return text[i] == '\0'; };
  return (zero(0) && !zero(1) && zero(2) && !zero(3)) || (!zero(0) && zero(1) && !zero(2) && zero(3));
}
inline constexpr const char* kUtf16Fault = "it is UTF-16 text; save it as UTF-8 or ASCII";

/// The whole word as a number, correctly rounded; "nan", "inf", "infinity" and 1.#IND are numbers. Values past the
/// range of Real become infinite, values below it 0.
template <class Real> std::optional<Real> parse_real(std::string_view word) {
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  Real value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size() || word.empty()) return parse_not_finite<Real>(word);
  // from_chars leaves the value alone then; strtold has the range for both ends.
  if (error == std::errc::result_out_of_range)
    return static_cast<Real>(std::strtold(std::string(word).c_str(), nullptr));
  if (error != std::errc{}) return std::nullopt;
  return value;
}

/// The whole word as an integer; nullopt if it is none or does not fit 64 bits.
inline std::optional<std::int64_t> parse_integer(std::string_view word) {
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// The start of the UTF-8 character that byte @p at belongs to; @p at itself where the text is no UTF-8.
inline std::size_t character_start(std::string_view text, std::size_t at) {
  constexpr std::size_t kMostTrailing = 3;
  for (std::size_t back = 0; back <= std::min(at, kMostTrailing); ++back)
    if ((static_cast<unsigned char>(text[at - back]) & 0xc0u) != 0x80u) return at - back;
  return at;
}

/// At most @p most bytes (at least 20): the start and the end of a longer text, with "..." between them.
inline std::string shortened(std::string_view text, std::size_t most) {
  if (text.size() <= most) return std::string(text);
  const std::size_t head = character_start(text, most - most / 3 - 3);
  // A character that begins earlier makes the end up to 3 bytes longer.
  const std::size_t tail = character_start(text, text.size() - (most / 3 - 3));
  return std::string(text.substr(0, head)).append("...").append(text.substr(tail));
}

/// A word for a message: cut to a sane length.
inline std::string in_quotes(std::string_view word) {
  constexpr std::size_t kMost = 40;
  if (word.size() <= kMost) return std::string(1, '\'').append(word).append("'");
  return std::string(1, '\'').append(word.substr(0, character_start(word, kMost))).append("...'");
}

}  // namespace hiprt::tools
