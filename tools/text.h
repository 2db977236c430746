#pragma once
/// Numbers and words of text formats.

#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

namespace hiprt::tools {

inline bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

/// Cuts the first word off @p text; empty when there is none. Words end at blanks (line breaks are no blanks).
inline std::string_view next_word(std::string_view& text) {
  std::size_t begin = 0;
  while (begin < text.size() && is_blank(text[begin])) ++begin;
  std::size_t end = begin;
  while (end < text.size() && !is_blank(text[end])) ++end;
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

/// Cuts the first line off @p text (without its line break).
inline std::string_view next_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return line;
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

/// A word for a message: cut to a sane length.
inline std::string in_quotes(std::string_view word) {
  constexpr std::size_t kMost = 40;
  std::string text(1, '\'');
  text.append(word.substr(0, kMost)).append(word.size() > kMost ? "...'" : "'");
  return text;
}

}  // namespace hiprt::tools
