#pragma once

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"

namespace binpose {

/// Walks through the lines or the words of a text file's bytes.
struct TextCursor {
  std::string_view rest;

  bool at_end() const { return rest.empty(); }

  /// Takes one line, without its end ("\n" or "\r\n").
  std::string_view next_line() {
    const std::size_t length = rest.find('\n');
    std::string_view line = rest.substr(0, length);
    rest.remove_prefix(length == std::string_view::npos ? rest.size() : length + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }

  /// Takes one word, across line ends; empty at the end of the text.
  std::string_view next_word() {
    std::size_t begin = 0;
    while (begin < rest.size() && absl::ascii_isspace(rest[begin])) ++begin;
    std::size_t end = begin;
    while (end < rest.size() && !absl::ascii_isspace(rest[end])) ++end;
    const std::string_view word = rest.substr(begin, end - begin);
    rest.remove_prefix(end);
    return word;
  }
};

/// The number that a whole word spells ("nan" and "inf" included), or nothing. Never depends on the locale.
template <typename Number>
std::optional<Number> parse_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  Number number{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return number;
}

/// Whether two words are equal but for capitals.
inline bool equal_ignoring_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char left, char right) { return absl::ascii_tolower(left) == absl::ascii_tolower(right); });
}

/// A word of a hostile file, shortened and made printable for an error message.
inline std::string in_quotes(std::string_view word) {
  return absl::StrCat("\"", absl::CHexEscape(std::string(word.substr(0, 32))), "\"");
}

}  // namespace binpose
