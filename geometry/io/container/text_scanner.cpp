// SPDX-License-Identifier: MIT
#include "geometry/io/container/text_scanner.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v'; }
char Lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

std::string Shown(std::string_view word) { return Excerpt(word, 40); }

// Byte order of UTF-16 text; nullopt for other text. Without a mark, it is detected from the ASCII
// that formats begin with: one byte of each unit is zero, the other is not.
std::optional<std::endian> Utf16Order(std::string_view bytes) {
  if (bytes.starts_with("\xFF\xFE")) return std::endian::little;
  if (bytes.starts_with("\xFE\xFF")) return std::endian::big;
  constexpr std::size_t kUnits = 8;
  if (bytes.size() < 2 * kUnits) return std::nullopt;
  for (const std::size_t high : {1, 0}) {
    bool ascii = true;
    for (std::size_t i = 0; i < 2 * kUnits; i += 2) {
      const char low = bytes[i + 1 - high];
      ascii = ascii && bytes[i + high] == '\0' && low >= '\t' && low < 127;
    }
    if (ascii) return high == 1 ? std::endian::little : std::endian::big;
  }
  return std::nullopt;
}

std::string Utf8FromUtf16(std::string_view bytes, std::endian order) {
  const auto unit = [&](std::size_t i) -> std::uint32_t {
    const auto a = static_cast<unsigned char>(bytes[i]),
               b = static_cast<unsigned char>(bytes[i + 1]);
    return order == std::endian::little ? a | b << 8 : b | a << 8;
  };
  std::string text;
  text.reserve(bytes.size() / 2);
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    std::uint32_t code = unit(i);
    if (code == 0xFEFF && i == 0) continue;
    if (code >= 0xD800 && code < 0xDC00 && i + 3 < bytes.size()) {
      const std::uint32_t low = unit(i + 2);
      if (low >= 0xDC00 && low < 0xE000) {
        code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
        i += 2;
      }
    }
    if (code >= 0xD800 && code < 0xE000) code = '?';  // unpaired surrogate
    AppendUtf8(text, code);
  }
  return text;
}

}  // namespace

std::string PlainText(std::string bytes, std::vector<std::string>& notes) {
  if (const auto order = Utf16Order(bytes)) {
    bytes = Utf8FromUtf16(bytes, *order);
    notes.emplace_back("the text is UTF-16: converted to UTF-8");
  } else if (bytes.starts_with("\xEF\xBB\xBF")) {
    bytes.erase(0, 3);
    notes.emplace_back("the text begins with a byte order mark (UTF-8): skipped");
  }
  const std::string_view head = std::string_view(bytes).substr(0, 512);
  if (head.find('\r') != head.npos && head.find('\0') == head.npos &&
      bytes.find('\n') == bytes.npos) {
    std::ranges::replace(bytes, '\r', '\n');
    notes.emplace_back("lines end in carriage returns only, as on classic Mac OS");
  }
  return bytes;
}

void AppendUtf8(std::string& text, std::uint32_t code) {
  const auto put = [&](std::uint32_t byte) { text.push_back(static_cast<char>(byte)); };
  const auto tail = [&](int shift) { put(0x80 | (code >> shift & 0x3F)); };
  if (code < 0x80) {
    put(code);
  } else if (code < 0x800) {
    put(0xC0 | code >> 6);
    tail(0);
  } else if (code < 0x10000) {
    put(0xE0 | code >> 12);
    tail(6);
    tail(0);
  } else {
    put(0xF0 | code >> 18);
    tail(12);
    tail(6);
    tail(0);
  }
}

std::string Excerpt(std::string_view text, std::size_t longest) {
  std::string shown;
  for (const char c : text.substr(0, longest)) shown += c >= ' ' && c < 127 ? c : '?';
  return text.size() > longest ? shown + "..." : shown;
}

std::string SomeNames(std::vector<std::string> names, std::size_t most) {
  const bool more = names.size() > most;
  if (more) names.resize(most);
  return fmt::format("{}{}", fmt::join(names, ", "), more ? ", ..." : "");
}

bool EqualIgnoringCase(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return Lower(x) == Lower(y); });
}

bool ParseNumber(std::string_view word, double& value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc::result_out_of_range && end == word.data() + word.size()) {
    // Axis angles of 1e-320 occur in practice; numbers too large for a double become infinite.
    const bool tiny = word.find("e-") != word.npos || word.find("E-") != word.npos;
    value = tiny ? 0.0 : HUGE_VAL;
    return true;
  }
  return error == std::errc() && end == word.data() + word.size() && !word.empty();
}

TextScanner::TextScanner(std::string name, std::string_view text, char comment)
    : name_(std::move(name)), text_(text), comment_(comment) {
  if (text_.starts_with("\xEF\xBB\xBF")) position_ = 3;
}

void TextScanner::SkipBlanks(std::size_t& position, int& line, bool stay_on_line) const {
  while (position < text_.size()) {
    const char c = text_[position];
    if (c == '\n') {
      if (stay_on_line) return;
      ++line;
      ++position;
    } else if (IsBlank(c)) {
      ++position;
    } else if (comment_ != '\0' && c == comment_) {
      while (position < text_.size() && text_[position] != '\n') ++position;
    } else {
      return;
    }
  }
}

std::string_view TextScanner::WordAt(std::size_t position) const {
  std::size_t end = position;
  while (end < text_.size() && !IsBlank(text_[end]) && text_[end] != '\n') ++end;
  return text_.substr(position, end - position);
}

bool TextScanner::AtEnd() { return Peek().empty(); }

std::string_view TextScanner::Peek() {
  std::size_t position = position_;
  int line = line_;
  SkipBlanks(position, line, false);
  return WordAt(position);
}

std::string_view TextScanner::Next() {
  SkipBlanks(position_, line_, false);
  const std::string_view word = WordAt(position_);
  position_ += word.size();
  return word;
}

std::string_view TextScanner::PeekOnLine() {
  std::size_t position = position_;
  int line = line_;
  SkipBlanks(position, line, true);
  return WordAt(position);
}

std::string_view TextScanner::RestOfLine() {
  SkipBlanks(position_, line_, true);
  std::size_t end = std::min(text_.find('\n', position_), text_.size());
  std::string_view rest = text_.substr(position_, end - position_);
  position_ = end;
  while (!rest.empty() && IsBlank(rest.back())) rest.remove_suffix(1);
  return rest;
}

double TextScanner::Number(std::string_view what) {
  const std::string_view word = Next();
  double value = 0;
  if (word.empty()) Fail(fmt::format("ends where {} is expected", what), "The file is cut short");
  if (!ParseNumber(word, value)) {
    Fail(fmt::format("expected {}, found '{}'", what, Shown(word)), "Repair the line");
  }
  if (!std::isfinite(value)) {
    Fail(fmt::format("{} is not finite ('{}')", what, Shown(word)),
         "Remove or interpolate the frames with gaps");
  }
  return value;
}

int TextScanner::Integer(std::string_view what, int lowest, int highest) {
  const double value = Number(what);
  if (value != std::floor(value) || value < lowest || value > highest) {
    Fail(fmt::format("{} is {}, not a whole number from {} to {}", what, value, lowest, highest),
         "Repair the line");
  }
  return static_cast<int>(value);
}

void TextScanner::Expect(std::string_view word, std::string_view context) {
  const std::string_view found = Next();
  if (EqualIgnoringCase(found, word)) return;
  Fail(found.empty() ? fmt::format("ends where '{}' is expected ({})", word, context)
                     : fmt::format("expected '{}' ({}), found '{}'", word, context, Shown(found)),
       "Repair the line, or export the motion again");
}

std::string TextScanner::Where() const { return fmt::format("{}:{}", name_, line_); }

void TextScanner::Fail(std::string_view problem, std::string_view remedy) const {
  throw Error(Where(), problem, remedy);
}

}  // namespace holdfast
