// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/pickle_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/text_scanner.h"

namespace holdfast {
namespace {

std::optional<unsigned> Hexadecimal(std::string_view digits) {
  unsigned value = 0;
  const char* end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, value, 16);
  if (error != std::errc() || stop != end || digits.empty()) return std::nullopt;
  return value;
}

// Appends what the escape at the front of `rest` (after its backslash) stands for, and removes it.
bool TakeEscape(std::string_view& rest, std::string& text) {
  if (rest.empty()) return false;
  const char letter = rest.front();
  rest.remove_prefix(1);
  constexpr std::string_view kLetters = "abtnvfr\\'\"";
  constexpr std::string_view kMeanings = "\a\b\t\n\v\f\r\\'\"";
  if (const auto at = kLetters.find(letter); at != std::string_view::npos) {
    text.push_back(kMeanings[at]);
  } else if (letter == 'x') {
    const auto code = rest.size() < 2 ? std::nullopt : Hexadecimal(rest.substr(0, 2));
    if (!code) return false;
    text.push_back(static_cast<char>(*code));
    rest.remove_prefix(2);
  } else if (letter >= '0' && letter <= '7') {
    unsigned code = static_cast<unsigned>(letter - '0');
    for (int i = 0; i < 2 && !rest.empty() && rest.front() >= '0' && rest.front() <= '7'; ++i) {
      code = 8 * code + static_cast<unsigned>(rest.front() - '0');
      rest.remove_prefix(1);
    }
    text.push_back(static_cast<char>(code));
  } else if (letter != '\n') {  // unknown escapes stand for themselves
    text.push_back('\\');
    text.push_back(letter);
  }
  return true;
}

}  // namespace

std::optional<std::string> DecodeStringLiteral(std::string_view literal) {
  while (literal.ends_with(' ')) literal.remove_suffix(1);
  if (literal.size() < 2 || literal.front() != literal.back() ||
      (literal.front() != '\'' && literal.front() != '"')) {
    return std::nullopt;
  }
  std::string_view rest = literal.substr(1, literal.size() - 2);
  std::string text;
  text.reserve(rest.size());
  while (!rest.empty()) {
    const auto slash = rest.find('\\');
    text.append(rest.substr(0, slash));
    if (slash == std::string_view::npos) break;
    rest.remove_prefix(slash + 1);
    if (!TakeEscape(rest, text)) return std::nullopt;
  }
  return text;
}

std::optional<std::string> DecodeRawUnicode(std::string_view line) {
  std::string text;
  text.reserve(line.size());
  for (std::size_t i = 0; i < line.size();) {
    const char next = i + 1 < line.size() ? line[i + 1] : '\0';
    if (line[i] != '\\' || (next != 'u' && next != 'U')) {
      AppendUtf8(text, static_cast<unsigned char>(line[i++]));
      continue;
    }
    const std::size_t digits = next == 'u' ? 4 : 8;
    const auto code =
        line.size() - i - 2 < digits ? std::nullopt : Hexadecimal(line.substr(i + 2, digits));
    if (!code || *code > 0x10ffff) return std::nullopt;
    AppendUtf8(text, *code);
    i += 2 + digits;
  }
  return text;
}

std::optional<std::string> EncodeLatin1(std::string_view utf8) {
  std::string bytes(utf8.size(), '\0');
  std::size_t count = 0;
  for (std::size_t i = 0; i < utf8.size(); ++i) {
    const auto lead = static_cast<unsigned char>(utf8[i]);
    if (lead < 0x80) {
      bytes[count++] = static_cast<char>(lead);
    } else if ((lead == 0xc2 || lead == 0xc3) && i + 1 < utf8.size()) {
      const auto next = static_cast<unsigned char>(utf8[++i]);
      bytes[count++] = static_cast<char>((lead & 3u) << 6 | (next & 0x3fu));
    } else {
      return std::nullopt;
    }
  }
  bytes.resize(count);
  return bytes;
}

std::optional<PickleInteger> ParseDecimal(std::string_view digits) {
  constexpr std::size_t kMaxDigits = 4300;  // as in Python
  if (digits.ends_with('L')) digits.remove_suffix(1);
  while (digits.starts_with(' ')) digits.remove_prefix(1);
  while (digits.ends_with(' ')) digits.remove_suffix(1);
  if (digits.empty() || digits.size() > kMaxDigits) return std::nullopt;
  std::int64_t value = 0;
  const char* end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, value);
  if (stop != end || error == std::errc::invalid_argument) return std::nullopt;
  if (error == std::errc()) return value;
  double real = digits.front() == '-' ? -HUGE_VAL : HUGE_VAL;  // kept if beyond all doubles
  std::from_chars(digits.data(), end, real);
  return real;
}

PickleInteger ParseTwosComplement(std::string_view bytes) {
  const bool negative = !bytes.empty() && (static_cast<unsigned char>(bytes.back()) & 0x80) != 0;
  const char filler = negative ? '\xff' : '\0';
  while (bytes.size() > 8 && bytes.back() == filler &&
         (static_cast<unsigned char>(bytes[bytes.size() - 2]) & 0x80) == (negative ? 0x80 : 0)) {
    bytes.remove_suffix(1);
  }
  if (bytes.size() <= 8) {
    std::uint64_t value = negative ? ~std::uint64_t{0} : 0;
    for (std::size_t i = bytes.size(); i-- > 0;) {
      value = value << 8 | static_cast<unsigned char>(bytes[i]);
    }
    return static_cast<std::int64_t>(value);
  }
  // A double cannot resolve more than the sixteen highest bytes.
  double value = negative ? -1.0 : 0.0;
  const std::size_t lowest = bytes.size() > 16 ? bytes.size() - 16 : 0;
  for (std::size_t i = bytes.size(); i-- > lowest;) {
    value = 256.0 * value + static_cast<unsigned char>(bytes[i]);
  }
  constexpr std::size_t kBeyondAllDoubles = 1024;
  return std::ldexp(value, static_cast<int>(8 * std::min(lowest, kBeyondAllDoubles)));
}

std::optional<double> ParseReal(std::string_view text) {
  while (text.starts_with(' ') || text.starts_with('+')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (stop != end || text.empty() || error != std::errc()) return std::nullopt;
  return value;
}

std::uint8_t PickleScanner::Byte() {
  if (position_ == bytes_.size()) FailDamaged("ends too early");
  return static_cast<std::uint8_t>(bytes_[position_++]);
}

std::string_view PickleScanner::Take(std::uint64_t count) {
  if (count > Left()) {
    FailDamaged(fmt::format("announces {} bytes where {} are left", count, Left()));
  }
  const std::string_view taken = bytes_.substr(position_, count);
  position_ += count;
  return taken;
}

std::string_view PickleScanner::Line() {
  const auto end = bytes_.find('\n', position_);
  if (end == std::string_view::npos) FailDamaged("ends within a line");
  std::string_view line = bytes_.substr(position_, end - position_);
  position_ = end + 1;
  // Python 2 wrote this pickle as text on Windows.
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::uint64_t PickleScanner::Unsigned(int bytes) {
  return FromLittleEndian(Take(static_cast<std::uint64_t>(bytes)));
}

void PickleScanner::FailDamaged(std::string_view problem) const {
  throw Error(where_, fmt::format("is not a whole pickle: it {} (at byte {})", problem, position_),
              "The file is damaged, cut off or of another kind: get it from its source again");
}

void PickleScanner::FailRefused(std::string_view problem, std::string_view remedy) const {
  throw Error(where_, fmt::format("{} (at byte {})", problem, position_), remedy);
}

}  // namespace holdfast
