#pragma once
/// Numbers and words of text formats.

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
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

/// Cuts a UTF-8 byte order mark off the start of a file's text.
inline void skip_byte_order_mark(std::string_view& text) {
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  if (text.starts_with(kMark)) text.remove_prefix(kMark.size());
}

/// The whole word as a number, correctly rounded; "nan", "inf" and "infinity" are numbers. Values past the range of
/// Real become infinite, values below it 0.
template <class Real> std::optional<Real> parse_real(std::string_view word) {
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  Real value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size() || word.empty()) return std::nullopt;
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
