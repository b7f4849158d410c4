// SPDX-License-Identifier: MIT
#include "geometry/io/container/npy_header.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"

namespace holdfast {
namespace {

constexpr std::size_t kMaxHeaderBytes = 1 << 16;
constexpr std::uint64_t kMaxElements = std::uint64_t{1} << 48;
constexpr std::uint64_t kMaxEmptyTexts = 1 << 20;

class HeaderParser {
 public:
  HeaderParser(std::string_view text, const std::string& where, bool allow_objects)
      : rest_(text), where_(where), allow_objects_(allow_objects) {}

  NpyArray Parse() {
    NpyArray array;
    bool has_descr = false, has_order = false, has_shape = false;
    Expect('{');
    while (!Accept('}')) {
      const std::string_view key = QuotedString();
      Expect(':');
      if (key == "descr") {
        SkipSpace();
        if (!rest_.empty() && rest_.front() != '\'' && rest_.front() != '"') {
          throw Error(where_, "holds records (a structured dtype)",
                      "Save the fields as separate arrays");
        }
        ParseDescr(QuotedString(), array);
        has_descr = true;
      } else if (key == "fortran_order") {
        array.fortran_order = Boolean();
        has_order = true;
      } else if (key == "shape") {
        array.shape = Tuple();
        has_shape = true;
      } else {
        Fail("an unknown header entry");
      }
      Accept(',');
    }
    if (!has_descr || !has_order || !has_shape) Fail("a header entry is missing");
    return array;
  }

 private:
  [[noreturn]] void Fail(std::string_view problem) const {
    throw Error(where_, fmt::format("has a malformed .npy header ({})", problem),
                "The file is damaged: save it again with numpy.savez");
  }
  void SkipSpace() {
    while (!rest_.empty() && (rest_.front() == ' ' || rest_.front() == '\n'))
      rest_.remove_prefix(1);
  }
  bool Accept(char c) {
    SkipSpace();
    if (rest_.empty() || rest_.front() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }
  void Expect(char c) {
    if (!Accept(c)) Fail(fmt::format("'{}' expected", c));
  }
  std::string_view QuotedString() {
    SkipSpace();
    if (rest_.empty() || (rest_.front() != '\'' && rest_.front() != '"')) Fail("a quote expected");
    const char quote = rest_.front();
    const auto end = rest_.find(quote, 1);
    if (end == std::string_view::npos) Fail("a text that does not end");
    const std::string_view text = rest_.substr(1, end - 1);
    rest_.remove_prefix(end + 1);
    return text;
  }
  bool Boolean() {
    SkipSpace();
    for (const auto& [word, value] :
         {std::pair{std::string_view("True"), true}, {"False", false}}) {
      if (rest_.starts_with(word)) {
        rest_.remove_prefix(word.size());
        return value;
      }
    }
    Fail("True or False expected");
  }
  std::vector<std::size_t> Tuple() {
    std::vector<std::size_t> values;
    Expect('(');
    while (!Accept(')')) {
      SkipSpace();
      std::size_t value = 0;
      const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
      if (error != std::errc()) Fail("a number expected in the shape");
      rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
      Accept('L');  // written by Python 2
      values.push_back(value);
      if (values.size() > kMaxRank) Fail("more than 32 dimensions");
      Accept(',');
    }
    return values;
  }
  void ParseDescr(std::string_view descr, NpyArray& array) const {
    if (descr.empty()) Fail("an empty dtype");
    if (std::string_view("<>|=").find(descr.front()) != std::string_view::npos) {
      array.big_endian = descr.front() == '>';
      descr.remove_prefix(1);
    }
    if (descr.empty()) Fail("an empty dtype");
    array.kind = descr.front() == '?' ? 'b' : descr.front();
    std::size_t size = array.kind == 'b' ? 1 : 0;
    if (descr.size() > 1) {
      const auto [end, error] =
          std::from_chars(descr.data() + 1, descr.data() + descr.size(), size);
      if (error != std::errc() || end != descr.data() + descr.size()) Fail("an unreadable dtype");
    }
    if (array.kind == 'O' && allow_objects_) {
      array.item_size = 0;
      return;
    }
    if (array.kind == 'O') {
      throw Error(where_, "holds Python objects (dtype object), which are never loaded",
                  "Save plain numeric arrays");
    }
    const bool known = (array.kind == 'f' && (size == 2 || size == 4 || size == 8)) ||
                       ((array.kind == 'i' || array.kind == 'u') &&
                        (size == 1 || size == 2 || size == 4 || size == 8)) ||
                       (array.kind == 'b' && size == 1) ||
                       ((array.kind == 'U' || array.kind == 'S') && size <= (1 << 20));
    if (!known) {
      throw Error(where_, fmt::format("has dtype '{}', which is not a real number or text", descr),
                  "Save it as float32, float64 or an integer type");
    }
    array.item_size = array.kind == 'U' ? 4 * size : size;
  }

  std::string_view rest_;
  const std::string& where_;
  bool allow_objects_;
};

}  // namespace

NpyArray ParseNpyHeader(std::string_view text, const std::string& where, bool allow_objects) {
  return HeaderParser(text, where, allow_objects).Parse();
}

NpyArray ReadNpyStart(const std::function<void(std::span<std::byte>)>& read,
                      const std::string& where, bool allow_objects) {
  const auto damaged = [&](std::string_view detail) {
    return Error(where, fmt::format("is damaged or cut off ({})", detail),
                 "Copy or save the file again");
  };
  std::string preamble(8, '\0');
  read(std::as_writable_bytes(std::span(preamble)));
  if (!preamble.starts_with(kNpyMagic)) throw damaged("not .npy data");
  std::string length(preamble[6] == 1 ? 2 : 4, '\0');
  read(std::as_writable_bytes(std::span(length)));
  const std::uint64_t header_bytes = FromLittleEndian(length);
  if (header_bytes > kMaxHeaderBytes) throw damaged("an oversized header");
  std::string header(header_bytes, '\0');
  read(std::as_writable_bytes(std::span(header)));
  return ParseNpyHeader(header, where, allow_objects);
}

std::size_t NpyDataBytes(const NpyArray& array, std::uint64_t available, const std::string& where) {
  const auto refuse = [&] {
    return Error(where,
                 fmt::format("is damaged or cut off (shape ({}) does not fit its {} bytes of data)",
                             fmt::join(array.shape, ", "), available),
                 "Copy or save the file again");
  };
  if (std::ranges::find(array.shape, std::size_t{0}) != array.shape.end()) return 0;
  std::uint64_t bytes = array.item_size;
  std::uint64_t elements = 1;
  for (const std::size_t n : array.shape) {
    if (n != 0 && (bytes > available / n || elements > kMaxElements / n)) throw refuse();
    bytes *= n;
    elements *= n;
  }
  if (bytes > available) throw refuse();
  // Empty texts (dtype U0) take no bytes, so the size of the data does not limit their number.
  if (bytes == 0 && elements > kMaxEmptyTexts) throw refuse();
  return static_cast<std::size_t>(bytes);
}

std::string EncodeNpy(const NpyArray& array) {
  const bool has_order = array.item_size > 1 && array.kind != 'S';
  const std::size_t count = array.kind == 'U' ? array.item_size / 4 : array.item_size;
  std::string shape;
  for (const std::size_t n : array.shape) shape += fmt::format("{}, ", n);
  if (array.shape.size() > 1)
    shape.resize(shape.size() - 2);
  else if (array.shape.size() == 1)
    shape.pop_back();  // "(5,)"
  std::string header = fmt::format("{{'descr': '{}{}{}', 'fortran_order': {}, 'shape': ({}), }}",
                                   has_order ? (array.big_endian ? '>' : '<') : '|', array.kind,
                                   count, array.fortran_order ? "True" : "False", shape);
  // Data start at a multiple of 64 bytes, as written by NumPy, so that files can be mapped.
  const std::size_t unpadded = kNpyMagic.size() + 2 + 2 + header.size() + 1;
  header.append((64 - unpadded % 64) % 64, ' ');
  header.push_back('\n');
  std::string bytes(kNpyMagic);
  bytes.push_back('\x01');
  bytes.push_back('\x00');
  bytes.push_back(static_cast<char>(header.size() & 0xff));
  bytes.push_back(static_cast<char>(header.size() >> 8));
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(array.data.data()), array.data.size());
  return bytes;
}

std::uint16_t FloatToHalf(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const auto sign = static_cast<std::uint16_t>((bits >> 16) & 0x8000u);
  const float magnitude = std::fabs(value);
  if (std::isnan(value)) return static_cast<std::uint16_t>(sign | 0x7e00u);
  if (magnitude >= 65520.0f) return static_cast<std::uint16_t>(sign | 0x7c00u);
  // Scaled so that one unit is the last place of the half: lrint then rounds to nearest even.
  const int exponent = std::max(magnitude > 0.0f ? std::ilogb(magnitude) : -14, -14);
  const auto units = static_cast<std::uint32_t>(
      std::lrint(std::ldexp(static_cast<double>(magnitude), 10 - exponent)));
  return static_cast<std::uint16_t>(
      sign + static_cast<std::uint16_t>(units + (static_cast<std::uint32_t>(exponent + 14) << 10)));
}

std::vector<std::uint16_t> ToHalves(std::span<const float> values, const std::string& where,
                                    std::string_view what) {
  std::vector<std::uint16_t> halves(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    halves[i] = FloatToHalf(values[i]);
    if (std::isfinite(values[i]) && !std::isfinite(HalfToFloat(halves[i]))) {
      throw Error(where, fmt::format("{} does not fit {}", values[i], what), "Use float32");
    }
  }
  return halves;
}

std::optional<std::size_t> CheckedProduct(std::span<const std::size_t> factors, std::size_t first) {
  std::size_t product = first;
  bool overflows = false;
  for (const std::size_t factor : factors) {
    if (factor == 0) return 0;
    overflows |= product > std::numeric_limits<std::size_t>::max() / factor;
    product *= factor;
  }
  if (overflows) return std::nullopt;
  return product;
}

}  // namespace holdfast
