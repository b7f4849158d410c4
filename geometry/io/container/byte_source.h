// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace holdfast {

/// Bytes that can be read from any place: an open file, which stays the file that was opened even
/// when another takes its name, or a piece of memory that must outlive the source.
class ByteSource {
 public:
  /// The one door through which files come in. Throws Error for a file that is missing, no regular
  /// file (a pipe is never waited for), empty, or may not be read.
  explicit ByteSource(const std::filesystem::path& path);
  /// `name` goes into messages.
  ByteSource(std::span<const std::byte> bytes, std::string name);
  ~ByteSource();
  ByteSource(ByteSource&& other) noexcept;
  ByteSource& operator=(ByteSource&& other) noexcept;

  std::uint64_t Size() const { return size_; }
  const std::string& Name() const { return name_; }
  /// Fills `target` from `offset` on, in large reads. Throws Error when the bytes end before.
  void ReadAt(std::uint64_t offset, std::span<std::byte> target) const;
  /// The first `count` bytes, or fewer in a shorter file.
  std::string Head(std::size_t count) const;
  /// All of it. Throws Error when there are more than `limit_bytes`.
  std::string Text(std::size_t limit_bytes) const;

 private:
  std::string name_;
  std::uint64_t size_ = 0;
  int descriptor_ = -1;
  const std::byte* memory_ = nullptr;
};

}  // namespace holdfast
