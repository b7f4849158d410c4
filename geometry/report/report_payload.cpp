// SPDX-License-Identifier: MIT
#include "geometry/report/report_payload.h"

#include <bit>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <type_traits>

#include <libdeflate.h>

namespace holdfast {
namespace {

static_assert(std::endian::native == std::endian::little, "the page reads little-endian arrays");

template <typename T>
constexpr std::string_view TypeName() {
  if constexpr (std::is_same_v<T, float>) return "f32";
  if constexpr (std::is_same_v<T, std::int16_t>) return "i16";
  if constexpr (std::is_same_v<T, std::int8_t>) return "i8";
  if constexpr (std::is_same_v<T, std::uint32_t>) return "u32";
  if constexpr (std::is_same_v<T, std::uint16_t>) return "u16";
  if constexpr (std::is_same_v<T, std::uint8_t>) return "u8";
}

// RFC 4648, with padding.
std::string Base64(std::string_view bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text((bytes.size() + 2) / 3 * 4, '=');
  auto digit = text.begin();
  for (std::size_t i = 0; i < bytes.size(); i += 3, digit += 4) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t triple = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      triple = triple << 8 | (k < n ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    }
    for (std::size_t k = 0; k <= n; ++k) {
      digit[static_cast<std::ptrdiff_t>(k)] = kDigits[triple >> (18 - 6 * k) & 63];
    }
  }
  return text;
}

}  // namespace

template <typename T>
void ReportPayload::Add(std::string_view name, std::span<const T> values, int stride) {
  bytes_.resize((bytes_.size() + 3) / 4 * 4, '\0');  // typed arrays must be aligned
  directory_[std::string(name)] = {{"type", TypeName<T>()},
                                   {"offset", bytes_.size()},
                                   {"count", values.size()},
                                   {"stride", stride}};
  bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

template void ReportPayload::Add(std::string_view, std::span<const float>, int);
template void ReportPayload::Add(std::string_view, std::span<const std::int16_t>, int);
template void ReportPayload::Add(std::string_view, std::span<const std::int8_t>, int);
template void ReportPayload::Add(std::string_view, std::span<const std::uint32_t>, int);
template void ReportPayload::Add(std::string_view, std::span<const std::uint16_t>, int);
template void ReportPayload::Add(std::string_view, std::span<const std::uint8_t>, int);

std::string ReportPayload::Encode() const {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(6), &libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  std::string deflated(libdeflate_zlib_compress_bound(compressor.get(), bytes_.size()), '\0');
  deflated.resize(libdeflate_zlib_compress(compressor.get(), bytes_.data(), bytes_.size(),
                                           deflated.data(), deflated.size()));
  return Base64(deflated);
}

}  // namespace holdfast
