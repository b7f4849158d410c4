// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

namespace holdfast {

/// How pickles write texts and whole numbers. Functions give nothing for what cannot be read.

/// A Python string literal, quotes and escapes included, as its bytes: 'a\x00\n'.
std::optional<std::string> DecodeStringLiteral(std::string_view literal);

/// Latin-1 with \uXXXX and \UXXXXXXXX (Python's raw-unicode-escape), as UTF-8.
std::optional<std::string> DecodeRawUnicode(std::string_view line);

/// Each character of a UTF-8 text as one byte; nothing when one is beyond 255. This is how Python 3
/// writes bytes in protocols that know none.
std::optional<std::string> EncodeLatin1(std::string_view utf8);

/// A whole number; beyond 64 bits the nearest real one.
using PickleInteger = std::variant<std::int64_t, double>;

/// Decimal digits, with Python 2's trailing L or not.
std::optional<PickleInteger> ParseDecimal(std::string_view digits);

/// Two's complement, little-endian, of any length; empty is 0.
PickleInteger ParseTwosComplement(std::string_view bytes);

/// As Python's float() takes it.
std::optional<double> ParseReal(std::string_view text);

/// The bytes of a pickle, read from front to back and never beyond the end: a length is compared
/// with what is left before anything is done with it. Throws Error with the position.
class PickleScanner {
 public:
  PickleScanner(std::span<const std::byte> bytes, const std::string& where)
      : bytes_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), where_(where) {}

  std::size_t Position() const { return position_; }
  std::size_t Left() const { return bytes_.size() - position_; }

  std::uint8_t Byte();
  std::string_view Take(std::uint64_t count);
  /// Up to the line's end, which is taken too.
  std::string_view Line();
  /// Unsigned little-endian number of 1 to 8 bytes.
  std::uint64_t Unsigned(int bytes);
  /// A number of so many bytes, and as many bytes as it says.
  std::string_view Counted(int bytes) { return Take(Unsigned(bytes)); }

  /// What stands at the position is not what a pickle has.
  [[noreturn]] void FailDamaged(std::string_view problem) const;
  /// A pickle that is whole, and asks for what is not given.
  [[noreturn]] void FailRefused(std::string_view problem, std::string_view remedy) const;

 private:
  std::string_view bytes_;
  std::size_t position_ = 0;
  const std::string& where_;
};

}  // namespace holdfast
