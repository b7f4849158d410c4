// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/io/container/npy_header.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/container/text_scanner.h"

namespace holdfast {
namespace {

static_assert(std::endian::native == std::endian::little, "written for little-endian machines");

template <typename T>
T LoadAs(const std::byte* bytes, bool big_endian) {
  std::array<std::byte, sizeof(T)> raw;
  std::memcpy(raw.data(), bytes, sizeof(T));
  if (big_endian) std::reverse(raw.begin(), raw.end());
  return std::bit_cast<T>(raw);
}

// Calls `put(c_order_index, byte_pointer)` for each element.
template <typename Put>
void ForEachElement(const NpyArray& array, Put&& put) {
  const std::size_t n = array.NumElements();
  const std::byte* bytes = array.data.data();
  if (!array.fortran_order || array.shape.size() < 2) {
    for (std::size_t i = 0; i < n; ++i) put(i, bytes + i * array.item_size);
    return;
  }
  // Traverse the storage in its own order (first index fastest) and track the C-order index.
  const std::size_t rank = array.shape.size();
  std::vector<std::size_t> stride(rank, 1), index(rank, 0);
  for (std::size_t d = rank - 1; d > 0; --d) stride[d - 1] = stride[d] * array.shape[d];
  std::size_t target = 0;
  for (std::size_t i = 0; i < n; ++i) {
    put(target, bytes + i * array.item_size);
    for (std::size_t d = 0; d < rank; ++d) {
      target += stride[d];
      if (++index[d] < array.shape[d]) break;
      target -= stride[d] * array.shape[d];
      index[d] = 0;
    }
  }
}

template <typename Out>
std::vector<Out> Convert(const NpyMember& member) {
  const NpyArray& array = member.array;
  if (std::string_view("fiub").find(array.kind) == std::string_view::npos) {
    throw Error(member.where, "holds text where numbers are needed", "Check the field");
  }
  if (const auto same = member.View<Out>()) return {same->begin(), same->end()};
  std::vector<Out> values(array.NumElements());
  const bool be = array.big_endian;
  const auto fill = [&]<typename Stored>(Stored) {
    ForEachElement(array, [&](std::size_t i, const std::byte* p) {
      values[i] = static_cast<Out>(LoadAs<Stored>(p, be));
    });
  };
  const auto fill_integers = [&](auto one, auto two, auto four, auto eight) {
    switch (array.item_size) {
      case 1:
        return fill(one);
      case 2:
        return fill(two);
      case 4:
        return fill(four);
      default:
        return fill(eight);
    }
  };
  if (array.kind == 'i') {
    fill_integers(std::int8_t{}, std::int16_t{}, std::int32_t{}, std::int64_t{});
  } else if (array.kind != 'f') {
    fill_integers(std::uint8_t{}, std::uint16_t{}, std::uint32_t{}, std::uint64_t{});
  } else if (array.item_size == 2) {
    ForEachElement(array, [&](std::size_t i, const std::byte* p) {
      values[i] = static_cast<Out>(HalfToFloat(LoadAs<std::uint16_t>(p, be)));
    });
  } else if (array.item_size == 4) {
    fill(float{});
  } else {
    fill(double{});
  }
  return values;
}

template <typename T>
constexpr char KindOf() {
  return std::is_floating_point_v<T> ? 'f' : std::is_signed_v<T> ? 'i' : 'u';
}

}  // namespace

std::size_t NpyArray::NumElements() const {
  std::size_t n = 1;
  for (const std::size_t d : shape) n *= d;
  return n;
}

template <typename T>
std::optional<std::span<const T>> NpyMember::View() const {
  const bool in_c_order = !array.fortran_order || array.shape.size() < 2;
  const bool in_place = reinterpret_cast<std::uintptr_t>(array.data.data()) % alignof(T) == 0;
  if (array.kind != KindOf<T>() || array.item_size != sizeof(T) || !in_c_order || !in_place ||
      (array.big_endian && sizeof(T) > 1)) {
    return std::nullopt;
  }
  // The bytes were read as values of T into storage that is aligned for T.
  return std::span<const T>(reinterpret_cast<const T*>(array.data.data()), array.NumElements());
}

template std::optional<std::span<const float>> NpyMember::View() const;
template std::optional<std::span<const double>> NpyMember::View() const;
template std::optional<std::span<const std::int8_t>> NpyMember::View() const;
template std::optional<std::span<const std::int16_t>> NpyMember::View() const;
template std::optional<std::span<const std::int32_t>> NpyMember::View() const;
template std::optional<std::span<const std::int64_t>> NpyMember::View() const;
template std::optional<std::span<const std::uint8_t>> NpyMember::View() const;
template std::optional<std::span<const std::uint16_t>> NpyMember::View() const;
template std::optional<std::span<const std::uint32_t>> NpyMember::View() const;
template std::optional<std::span<const std::uint64_t>> NpyMember::View() const;

std::vector<double> NpyMember::AsDoubles() const { return Convert<double>(*this); }
std::vector<float> NpyMember::AsFloats() const { return Convert<float>(*this); }

std::vector<std::int64_t> NpyMember::AsIntegers() const {
  if (array.kind != 'f') return Convert<std::int64_t>(*this);
  const std::vector<double> doubles = AsDoubles();
  std::vector<std::int64_t> integers(doubles.size());
  for (std::size_t i = 0; i < doubles.size(); ++i) {
    if (!(std::fabs(doubles[i]) < 0x1p53) || doubles[i] != std::floor(doubles[i])) {
      throw Error(where, fmt::format("holds {} where a whole number is needed", doubles[i]),
                  "Check the field");
    }
    integers[i] = static_cast<std::int64_t>(doubles[i]);
  }
  return integers;
}

std::string NpyMember::AsText() const {
  if ((array.kind != 'U' && array.kind != 'S') || array.NumElements() != 1) {
    throw Error(where, fmt::format("is not a single text (shape {})", ShapeText()),
                "Save it as a string");
  }
  std::string text;
  if (array.kind == 'S') {
    for (const std::byte b : array.data) text.push_back(static_cast<char>(b));
  } else {
    for (std::size_t i = 0; i + 4 <= array.data.size(); i += 4) {
      const auto code = LoadAs<std::uint32_t>(array.data.data() + i, array.big_endian);
      if (code >= 0x110000) {
        throw Error(where, "holds an invalid character", "Save the text again");
      }
      AppendUtf8(text, code);
    }
  }
  while (!text.empty() && text.back() == '\0') text.pop_back();
  return text;
}

std::string NpyMember::ShapeText() const {
  return fmt::format("({})", fmt::join(array.shape, ", "));
}

void NpyMember::RequireShape(const std::vector<std::ptrdiff_t>& expected) const {
  bool matches = expected.size() == array.shape.size();
  for (std::size_t d = 0; matches && d < expected.size(); ++d) {
    matches = expected[d] < 0 || static_cast<std::size_t>(expected[d]) == array.shape[d];
  }
  if (matches) return;
  std::vector<std::string> wanted;
  for (const std::ptrdiff_t n : expected) wanted.push_back(n < 0 ? "N" : std::to_string(n));
  throw Error(where, fmt::format("has shape {}", ShapeText()),
              fmt::format("Shape ({}) is needed", fmt::join(wanted, ", ")));
}

}  // namespace holdfast
