// SPDX-License-Identifier: MIT
#include "geometry/io/gzip_text.h"

#include <memory>
#include <vector>

#include <fmt/format.h>
#include <zlib.h>

#include "geometry/error.h"

namespace holdfast {

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

  std::string text;
  std::vector<char> chunk(std::size_t{1} << 18);
  while (true) {
    const int count = gzread(file.get(), chunk.data(), static_cast<unsigned>(chunk.size()));
    if (count < 0) {
      int code = 0;
      throw Error(where, fmt::format("damaged gzip data ({})", gzerror(file.get(), &code)),
                  "Fetch the file again");
    }
    if (count == 0) break;
    if (text.size() + static_cast<std::size_t>(count) > limit_bytes) {
      throw Error(where, fmt::format("unpacks to more than {} bytes", limit_bytes),
                  "Cut the motion into parts");
    }
    text.append(chunk.data(), static_cast<std::size_t>(count));
  }
  int code = Z_OK;
  gzerror(file.get(), &code);
  if (code == Z_BUF_ERROR) {
    throw Error(where, "gzip data ends too early", "Fetch the file again");
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
