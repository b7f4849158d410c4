// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace holdfast {

/// Largest text a motion file may unpack to: hours of capture, yet no zip bomb.
inline constexpr std::size_t kMotionTextLimit = std::size_t{1} << 30;

/// The whole file as text, unpacked when it is gzip'd (by content, not by name). Throws Error when
/// it cannot be opened, is not a regular file, is damaged or cut short, or unpacks to more than
/// `limit_bytes`, or than ten times the file and 48 MB.
std::string ReadGzipText(const std::filesystem::path& path,
                         std::size_t limit_bytes = kMotionTextLimit);

/// The first `bytes` of it or fewer, for telling formats apart; empty when it cannot be read.
std::string ReadGzipHead(const std::filesystem::path& path, std::size_t bytes);

}  // namespace holdfast
