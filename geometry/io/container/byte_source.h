// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

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

/// FNV-1a (Fowler, Noll & Vo), 64 bits, as text.
std::string Checksum(std::string_view bytes);
/// The same of all bytes of a source.
std::string Checksum(const ByteSource& source);

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
