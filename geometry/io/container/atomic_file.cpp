// SPDX-License-Identifier: MIT
#include "geometry/io/container/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

void FlushToDisk(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY);
  if (descriptor < 0) {
    throw Error(path.string(), fmt::format("cannot be reopened ({})", std::strerror(errno)),
                "Check the folder");
  }
  const int failed = ::fsync(descriptor);
  const int reason = errno;
  ::close(descriptor);
  // Some file systems (pipes, /dev/full) do not support fsync; this alone is not a failure.
  if (failed != 0 && reason != EINVAL && reason != EROFS) {
    throw Error(path.string(), fmt::format("could not be written ({})", std::strerror(reason)),
                "Free some space or choose another folder");
  }
}

}  // namespace

void WriteAtomically(const fs::path& path, const std::function<void(const fs::path&)>& write) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder, error)) {
    throw Error(path.string(), fmt::format("the folder '{}' cannot be created", folder.string()),
                "Choose another output path");
  }
  if (fs::is_directory(path, error)) {
    throw Error(path.string(), "is a folder, but a file is to be written", "Choose a file name");
  }
  // Keep the extension: some writers choose the format by it.
  const fs::path temporary = folder / fmt::format(".{}.tmp{}{}", path.stem().string(), ::getpid(),
                                                  path.extension().string());
  try {
    write(temporary);
    FlushToDisk(temporary);
    fs::rename(temporary, path, error);
    if (error) {
      throw Error(path.string(), fmt::format("could not be replaced ({})", error.message()),
                  "Check the permissions of the folder");
    }
  } catch (...) {
    fs::remove(temporary, error);
    throw;
  }
}

void WriteAtomically(const fs::path& path, std::string_view content) {
  WriteAtomically(path, [&](const fs::path& temporary) {
    errno = 0;
    std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
    out.write(content.data(), static_cast<std::streamsize>(content.size()));
    out.close();
    if (!out) {
      throw Error(path.string(),
                  fmt::format("could not be written ({})",
                              errno != 0 ? std::strerror(errno) : "write failed"),
                  "Free some space or choose another folder");
    }
  });
}

std::string ReadFile(const fs::path& path, std::size_t limit_bytes) {
  return ByteSource(path).Text(limit_bytes);
}

}  // namespace holdfast
