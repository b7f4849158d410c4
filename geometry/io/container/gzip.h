// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "geometry/io/container/byte_source.h"

namespace holdfast {

/// Largest text a motion file may unpack to: hours of capture, yet no zip bomb.
inline constexpr std::size_t kMotionTextLimit = std::size_t{1} << 30;

/// What a gzip'd file holds. It is unpacked twice, first only to see that it is whole and how long,
/// so that memory is taken once and for sound data alone. Throws Error when it is damaged, cut off,
/// holds nothing, or unpacks to more than `limit_bytes`.
std::vector<std::byte> ReadGzip(const ByteSource& source, std::size_t limit_bytes);

/// The whole file as text, unpacked when it is gzip'd (by content, not by name). Throws Error as
/// ByteSource and ReadGzip do; also where it unpacks to more than ten times the file and 48 MB.
std::string ReadGzipText(const std::filesystem::path& path,
                         std::size_t limit_bytes = kMotionTextLimit);

/// The first `bytes` of it or fewer, for telling formats apart; empty when it cannot be read.
std::string ReadGzipHead(const std::filesystem::path& path, std::size_t bytes);

}  // namespace holdfast
