// SPDX-License-Identifier: MIT
#include "geometry/body/linear_basis.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <optional>
#include <span>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/npy_header.h"
#include "geometry/value_ranges.h"

namespace holdfast {
namespace {

template <typename T>
std::span<const T> As(const std::vector<std::byte>& data) {
  return {reinterpret_cast<const T*>(data.data()), data.size() / sizeof(T)};
}

// The largest finite half is 65,504, so values beyond kMaxMeters are infinite or NaN.
std::optional<std::size_t> FirstNotFinite(std::span<const std::uint16_t> halves) {
  static_assert(kMaxMeters > 65504.0);
  const auto bits = [](std::uint16_t half) { return half & 0x7fff; };
  int most = 0;
  for (const std::uint16_t half : halves) most = std::max(most, bits(half));
  if (most < 0x7c00) return std::nullopt;
  const auto bad = std::ranges::find_if(halves, [&](auto half) { return bits(half) >= 0x7c00; });
  return static_cast<std::size_t>(bad - halves.begin());
}

}  // namespace

LinearBasis::LinearBasis(NpyMember member, std::ptrdiff_t vertices, std::ptrdiff_t columns) {
  member.RequireShape({vertices, 3, columns});
  NpyArray& array = member.array;
  columns_ = array.shape[2];
  item_size_ = array.kind != 'f' || array.item_size >= 8 ? 8 : 4;
  std::vector<std::byte> data;
  const auto copy = [&](const auto& values) {
    data.resize(values.size() * sizeof(values[0]));
    if (!values.empty()) std::memcpy(data.data(), values.data(), data.size());
  };
  const bool halves =
      array.kind == 'f' && array.item_size == 2 && !array.big_endian && !array.fortran_order;
  if (halves) item_size_ = 2;
  if (halves || member.View<float>() || member.View<double>()) {
    data = std::move(array.data);
  } else if (item_size_ == 8) {
    copy(member.AsDoubles());
  } else {
    copy(member.AsFloats());
  }
  const auto bad = item_size_ == 8   ? FirstBeyond(As<double>(data), kMaxMeters)
                   : item_size_ == 4 ? FirstBeyond(As<float>(data), kMaxMeters)
                                     : FirstNotFinite(As<std::uint16_t>(data));
  if (bad) {
    const double value = item_size_ == 8   ? As<double>(data)[*bad]
                         : item_size_ == 4 ? As<float>(data)[*bad]
                                           : HalfToFloat(As<std::uint16_t>(data)[*bad]);
    throw Error(member.where, fmt::format("holds {} at element {}", value, *bad),
                "The model file is damaged: get it again");
  }
  data_ = std::make_shared<const std::vector<std::byte>>(std::move(data));
}

void LinearBasis::Negate(std::size_t coordinate) {
  if (!data_ || columns_ == 0) return;
  std::vector<std::byte> data = *data_;
  const std::size_t row_bytes = columns_ * item_size_;
  for (std::size_t row = coordinate; (row + 1) * row_bytes <= data.size(); row += 3) {
    // The sign is the highest bit of the last byte, in all three types.
    for (std::size_t k = 0; k < columns_; ++k) {
      data[row * row_bytes + (k + 1) * item_size_ - 1] ^= std::byte{0x80};
    }
  }
  data_ = std::make_shared<const std::vector<std::byte>>(std::move(data));
}

void LinearBasis::CopyRow(std::size_t row, std::size_t begin, std::size_t count,
                          double* out) const {
  const std::size_t first = row * columns_ + begin;
  if (item_size_ == 8) {
    std::memcpy(out, As<double>(*data_).data() + first, count * sizeof(double));
  } else if (item_size_ == 4) {
    std::copy_n(As<float>(*data_).data() + first, count, out);
  } else {
    std::transform(As<std::uint16_t>(*data_).data() + first,
                   As<std::uint16_t>(*data_).data() + first + count, out, HalfToFloat);
  }
}

bool LinearBasis::IsZero(std::size_t row, std::size_t begin, std::size_t count) const {
  const std::size_t first = row * columns_ + begin;
  const std::byte* const bytes = data_->data() + first * item_size_;
  const std::size_t size = count * item_size_;
  // The common case, tested at once: each byte equals its predecessor and the first is 0.
  if (size == 0 || (bytes[0] == std::byte{0} && std::memcmp(bytes, bytes + 1, size - 1) == 0)) {
    return true;
  }
  const auto zeros = [&](const auto& values) {
    return std::ranges::all_of(values.subspan(first, count), [](auto x) { return x == 0; });
  };
  if (item_size_ == 8) return zeros(As<double>(*data_));
  if (item_size_ == 4) return zeros(As<float>(*data_));
  return std::ranges::all_of(As<std::uint16_t>(*data_).subspan(first, count),
                             [](unsigned half) { return (half & 0x7fff) == 0; });  // 0 or -0
}

}  // namespace holdfast
