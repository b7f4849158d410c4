// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace holdfast {

/// Writes a file atomically: `write` fills a temporary file in the same folder, which is flushed to
/// disk and renamed to `path`. Creates missing folders. If `write` throws or the disk is full, the
/// temporary file is removed and the previous file at `path` is unchanged.
void WriteAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

/// Same for a text or byte string.
void WriteAtomically(const std::filesystem::path& path, std::string_view content);

/// Returns the whole file as bytes. Throws Error if it cannot be opened or read, or exceeds
/// `limit_bytes`.
std::string ReadFile(const std::filesystem::path& path,
                     std::size_t limit_bytes = std::size_t{4} << 30);

}  // namespace holdfast
