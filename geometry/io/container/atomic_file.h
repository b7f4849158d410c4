// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace holdfast {

/// Writes a file so that `path` is never seen half-written: `write` fills a temporary beside it,
/// which is flushed to disk and renamed over `path`; folders above it are made. When `write`
/// throws, or the disk is full, the temporary is removed and whatever was at `path` is untouched.
void WriteAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

/// The same for a text or byte string.
void WriteAtomically(const std::filesystem::path& path, std::string_view content);

/// The whole file as bytes. Throws Error when it cannot be opened or read, or exceeds
/// `limit_bytes`.
std::string ReadFile(const std::filesystem::path& path,
                     std::size_t limit_bytes = std::size_t{4} << 30);

}  // namespace holdfast
