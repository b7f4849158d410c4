// SPDX-License-Identifier: MIT
#include "geometry/io/gzip_text.h"

#include <algorithm>
#include <memory>
#include <vector>

#include <fmt/format.h>
#include <zlib.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

constexpr std::size_t kChunkBytes = std::size_t{1} << 18;
constexpr std::size_t kAlwaysBytes = std::size_t{48} << 20;

}  // namespace

std::string ReadGzipText(const std::filesystem::path& path, std::size_t limit_bytes) {
  const std::string where = path.string();
  std::error_code status_error;
  const auto status = std::filesystem::status(path, status_error);
  if (!std::filesystem::exists(status)) {
    throw Error(where, "no such file", "Check the path");
  }
  if (std::filesystem::is_directory(status)) {
    throw Error(where, "is a folder, not a file", "Give one motion file");
  }
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), gzclose_r);
  if (!file) throw Error(where, "cannot be opened", "Check that you may read it");

  // A text of motion packs to a tenth at best; a small one may be anything.
  std::error_code size_error;
  const std::uintmax_t packed = std::filesystem::file_size(path, size_error);
  if (!size_error) limit_bytes = std::min<std::uintmax_t>(limit_bytes, kAlwaysBytes + 10 * packed);

  const auto read = [&](char* target, std::size_t bytes) {
    const int count = gzread(file.get(), target, static_cast<unsigned>(bytes));
    if (count < 0) {
      int code = 0;
      throw Error(where, fmt::format("damaged gzip data ({})", gzerror(file.get(), &code)),
                  "Fetch the file again");
    }
    return static_cast<std::size_t>(count);
  };
  // Once for the length and whether all is well, so that memory is taken once and for sound data.
  std::size_t length = 0;
  std::vector<char> chunk(kChunkBytes);
  while (const std::size_t count = read(chunk.data(), chunk.size())) {
    length += count;
    if (length > limit_bytes) {
      throw Error(where, fmt::format("unpacks to more than {} bytes", limit_bytes),
                  "Cut the motion into parts, or unpack it first (gunzip)");
    }
  }
  int code = Z_OK;
  gzerror(file.get(), &code);
  if (code == Z_BUF_ERROR) {
    throw Error(where, "gzip data ends too early", "Fetch the file again");
  }
  gzrewind(file.get());
  std::string text(length, '\0');
  for (std::size_t at = 0; at < length;) {
    const std::size_t count = read(text.data() + at, std::min(kChunkBytes, length - at));
    if (count == 0) throw Error(where, "changes while it is read", "Wait until it is written");
    at += count;
  }
  return text;
}

std::string ReadGzipHead(const std::filesystem::path& path, std::size_t bytes) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return {};
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), gzclose_r);
  if (!file) return {};
  std::string head(bytes, '\0');
  const int count = gzread(file.get(), head.data(), static_cast<unsigned>(bytes));
  head.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
  return head;
}

}  // namespace holdfast
