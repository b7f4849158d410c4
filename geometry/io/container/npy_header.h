// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "geometry/io/container/npz.h"

namespace holdfast {

/// Returns an array of a vector's or a span's values in C order. `shape` is not checked against the
/// number of values.
template <typename Values>
NpyArray MakeNpyArray(char kind, std::vector<std::size_t> shape, const Values& values) {
  NpyArray array{kind, sizeof(typename Values::value_type), false, false, std::move(shape), {}};
  const std::span<const std::byte> bytes = std::as_bytes(std::span(values));
  array.data.assign(bytes.begin(), bytes.end());
  return array;
}

/// Reads the header of a `.npy` member: a Python dictionary literal of three known entries, parsed
/// and never evaluated. Returns the array without its data. An array of Python objects has kind 'O'
/// (item_size 0) if `allow_objects`. Throws Error, named `where`, for anything else, and for
/// element types that are neither real numbers nor text.
NpyArray ParseNpyHeader(std::string_view text, const std::string& where,
                        bool allow_objects = false);

/// Reads a `.npy` up to its data: magic number, version, header. `read` fills its argument with the
/// next bytes or throws. Returns the array without its data.
NpyArray ReadNpyStart(const std::function<void(std::span<std::byte>)>& read,
                      const std::string& where, bool allow_objects);

/// Size in bytes of the data that a header declares. Throws Error, named `where`, if it exceeds
/// `available`: no shape is trusted unless its data exist.
std::size_t NpyDataBytes(const NpyArray& array, std::uint64_t available, const std::string& where);

/// Encodes an array as the bytes of a `.npy` file, version 1.
std::string EncodeNpy(const NpyArray& array);

inline constexpr std::string_view kNpyMagic("\x93NUMPY", 6);

/// IEEE 754 half precision to single, exact. Branch-free: body models have millions of values.
inline float HalfToFloat(std::uint16_t half) {
  constexpr std::uint32_t kRebias = 112u << 23;
  const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000u) << 16;
  const std::uint32_t magnitude = static_cast<std::uint32_t>(half & 0x7fffu) << 13;
  const std::uint32_t normal = magnitude + kRebias;
  const std::uint32_t infinite = normal + kRebias;  // or NaN
  const auto subnormal =
      std::bit_cast<std::uint32_t>(std::bit_cast<float>(normal + (1u << 23)) - 0x1p-14f);
  const std::uint32_t finite = magnitude < (1u << 23) ? subnormal : normal;
  return std::bit_cast<float>(sign | (magnitude < (31u << 23) ? finite : infinite));
}

/// Single to half precision, rounded to nearest even; infinity beyond 65504.
std::uint16_t FloatToHalf(float value);

/// Same for many numbers. Throws Error, named `where`, for a finite one that does not fit `what`.
std::vector<std::uint16_t> ToHalves(std::span<const float> values, const std::string& where,
                                    std::string_view what);

/// Product of `first` and all factors; nullopt on overflow.
std::optional<std::size_t> CheckedProduct(std::span<const std::size_t> factors, std::size_t first);

}  // namespace holdfast
