// SPDX-License-Identifier: MIT
#pragma once

#include <zlib.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace holdfast::testing {

/// A number as `bytes` little-endian bytes.
inline std::string LittleEndian(std::uint64_t value, int bytes) {
  std::string text;
  for (int k = 0; k < bytes; ++k) text.push_back(static_cast<char>(value >> (8 * k)));
  return text;
}

/// Raw deflate of a text.
inline std::string Deflated(const std::string& text, int window_bits = -MAX_WBITS) {
  z_stream state{};
  deflateInit2(&state, 1, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY);
  std::string packed(deflateBound(&state, static_cast<uLong>(text.size())) + 64, '\0');
  state.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  state.avail_in = static_cast<uInt>(text.size());
  state.next_out = reinterpret_cast<Bytef*>(packed.data());
  state.avail_out = static_cast<uInt>(packed.size());
  deflate(&state, Z_FINISH);
  packed.resize(state.total_out);
  deflateEnd(&state);
  return packed;
}

inline std::string Gzipped(const std::string& text) { return Deflated(text, MAX_WBITS + 16); }

/// One member of an archive made by hand; what is set may be a lie.
struct ZipPart {
  std::string name;
  std::string content;
  int method = 0;  ///< 8 deflates `content`
  int flags = 0;
  bool zip64 = false;                                ///< sizes in the extra field
  std::optional<std::uint64_t> size = std::nullopt;  ///< claimed, unpacked
  std::optional<std::uint32_t> checksum = std::nullopt;
};

/// An archive byte by byte as the format defines it, so that a reader is held against the format
/// and not against our own writer.
inline std::string ZipBytes(const std::vector<ZipPart>& parts, const std::string& prefix = "") {
  std::string local = prefix, central;
  for (const ZipPart& part : parts) {
    const auto crc = part.checksum.value_or(static_cast<std::uint32_t>(
        crc32_z(0, reinterpret_cast<const Bytef*>(part.content.data()), part.content.size())));
    const std::string packed = part.method == 8 ? Deflated(part.content) : part.content;
    const std::uint64_t size = part.size.value_or(part.content.size());
    const std::string extra = part.zip64
                                  ? LittleEndian(1, 2) + LittleEndian(16, 2) +
                                        LittleEndian(size, 8) + LittleEndian(packed.size(), 8)
                                  : "";
    const auto number = [&](std::uint64_t value) {
      return LittleEndian(part.zip64 ? 0xffffffffu : value, 4);
    };
    const std::string common =
        LittleEndian(45, 2) + LittleEndian(part.flags, 2) + LittleEndian(part.method, 2) +
        LittleEndian(0, 2) + LittleEndian(33, 2) + LittleEndian(crc, 4) + number(packed.size()) +
        number(size) + LittleEndian(part.name.size(), 2) + LittleEndian(extra.size(), 2);
    central += "PK\x01\x02" + LittleEndian(20, 2) + common + LittleEndian(0, 10) +
               LittleEndian(local.size() - prefix.size(), 4) + part.name + extra;
    local += "PK\x03\x04" + common + part.name + extra + packed;
  }
  const std::uint64_t offset = local.size() - prefix.size();
  std::string end;
  std::uint64_t count = parts.size();
  if (count >= 0xffff) {
    end = "PK\x06\x06" + LittleEndian(44, 8) + LittleEndian(45, 2) + LittleEndian(45, 2) +
          LittleEndian(0, 8) + LittleEndian(count, 8) + LittleEndian(count, 8) +
          LittleEndian(central.size(), 8) + LittleEndian(offset, 8);
    end += "PK\x06\x07" + LittleEndian(0, 4) + LittleEndian(offset + central.size(), 8) +
           LittleEndian(1, 4);
    count = 0xffff;
  }
  return local + central + end + "PK\x05\x06" + LittleEndian(0, 4) + LittleEndian(count, 2) +
         LittleEndian(count, 2) + LittleEndian(central.size(), 4) + LittleEndian(offset, 4) +
         LittleEndian(0, 2);
}

/// A `.npy`, version 1, with the given header and data.
inline std::string NpyBytes(std::string header, const std::string& data) {
  while ((10 + header.size() + 1) % 16 != 0) header += ' ';
  header += '\n';
  return std::string("\x93NUMPY\x01\x00", 8) + LittleEndian(header.size(), 2) + header + data;
}

/// Bytes of numbers as this machine (little-endian) keeps them.
template <typename T>
std::string BytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

}  // namespace holdfast::testing
