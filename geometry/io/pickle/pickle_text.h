// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

namespace holdfast {

/// Texts and whole numbers as pickles write them. Functions return nullopt for invalid input.

/// Decodes a Python string literal, quotes and escapes included, to bytes: 'a\x00\n'.
std::optional<std::string> DecodeStringLiteral(std::string_view literal);

/// Decodes Latin-1 with \uXXXX and \UXXXXXXXX (Python's raw-unicode-escape) to UTF-8.
std::optional<std::string> DecodeRawUnicode(std::string_view line);

/// Encodes each character of a UTF-8 text as one byte; nullopt if one is beyond 255. Python 3
/// writes bytes like this in protocols without a type for them.
std::optional<std::string> EncodeLatin1(std::string_view utf8);

/// A whole number; beyond 64 bits, the nearest real number.
using PickleInteger = std::variant<std::int64_t, double>;

/// Parses decimal digits, with or without Python 2's trailing L.
std::optional<PickleInteger> ParseDecimal(std::string_view digits);

/// Parses a two's complement, little-endian, of any length; empty is 0.
PickleInteger ParseTwosComplement(std::string_view bytes);

/// Parses a number as Python's float() does.
std::optional<double> ParseReal(std::string_view text);

/// Reads the bytes of a pickle from front to back and never beyond the end: a length is compared
/// with the remaining bytes before it is used. Throws Error with the position.
class PickleScanner {
 public:
  PickleScanner(std::span<const std::byte> bytes, const std::string& where)
      : bytes_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), where_(where) {}

  std::size_t Position() const { return position_; }
  std::size_t Left() const { return bytes_.size() - position_; }

  std::uint8_t Byte();
  std::string_view Take(std::uint64_t count);
  /// Returns the text up to the line's end, and skips the line's end.
  std::string_view Line();
  /// Unsigned little-endian number of 1 to 8 bytes.
  std::uint64_t Unsigned(int bytes);
  /// Reads a number of `bytes` bytes, then as many bytes as it states.
  std::string_view Counted(int bytes) { return Take(Unsigned(bytes)); }

  /// Throws Error: the bytes at the position are not those of a pickle.
  [[noreturn]] void FailDamaged(std::string_view problem) const;
  /// Throws Error: the pickle is intact, but asks for something that is refused.
  [[noreturn]] void FailRefused(std::string_view problem, std::string_view remedy) const;

 private:
  std::string_view bytes_;
  std::size_t position_ = 0;
  const std::string& where_;
};

}  // namespace holdfast
