// SPDX-License-Identifier: MIT
#include "geometry/io/container/checksum.h"

#include <cstdint>
#include <span>

#include <fmt/format.h>

namespace holdfast {

std::string Checksum(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325ull;
  for (const char c : bytes) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  }
  return fmt::format("{:016x}", hash);
}

std::string Checksum(const ByteSource& source) {
  std::string bytes(source.Size(), '\0');
  source.ReadAt(0, std::as_writable_bytes(std::span(bytes)));
  return Checksum(bytes);
}

}  // namespace holdfast
