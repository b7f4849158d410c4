// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
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

}  // namespace holdfast
