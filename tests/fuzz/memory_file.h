// SPDX-License-Identifier: MIT
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "tests/fuzz/fuzz_target.h"

namespace holdfast::fuzz {

/// Bytes as a file without a disk, for readers that want a path.
class MemoryFile {
 public:
  explicit MemoryFile(std::span<const std::byte> bytes)
      : descriptor_(memfd_create("holdfast_fuzz", MFD_CLOEXEC)) {
    Require(descriptor_ >= 0, "no memory file could be made");
    for (std::size_t written = 0; written < bytes.size();) {
      const ssize_t count = write(descriptor_, bytes.data() + written, bytes.size() - written);
      Require(count > 0, "the memory file could not be filled");
      written += static_cast<std::size_t>(count);
    }
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::filesystem::path Path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

/// A file that a writer makes and a reader takes up again; gone at the end.
class ScratchFile {
 public:
  explicit ScratchFile(const std::string& extension)
      : path_(Folder() / ("holdfast_fuzz_" + std::to_string(getpid()) + extension)) {}
  ~ScratchFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  const std::filesystem::path& Path() const { return path_; }

 private:
  // In memory where the system has such a folder: fsync costs nothing there.
  static std::filesystem::path Folder() {
    std::error_code ignored;
    return std::filesystem::is_directory("/dev/shm", ignored)
               ? std::filesystem::path("/dev/shm")
               : std::filesystem::temp_directory_path();
  }

  std::filesystem::path path_;
};

}  // namespace holdfast::fuzz
