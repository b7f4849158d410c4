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

/// Bytes with random access: an open file, which stays the same even if another file takes its
/// name, or a block of memory that must outlive the source.
class ByteSource {
 public:
  /// Opens a file; all input files are opened here. Throws Error for a file that is missing, not
  /// regular (pipes are never waited for), empty, or not readable.
  explicit ByteSource(const std::filesystem::path& path);
  /// `name` is used in messages.
  ByteSource(std::span<const std::byte> bytes, std::string name);
  ~ByteSource();
  ByteSource(ByteSource&& other) noexcept;
  ByteSource& operator=(ByteSource&& other) noexcept;

  std::uint64_t Size() const { return size_; }
  const std::string& Name() const { return name_; }
  /// Fills `target` from `offset` on, in large reads. Throws Error if the bytes end earlier.
  void ReadAt(std::uint64_t offset, std::span<std::byte> target) const;
  /// Returns the first `count` bytes, fewer for a shorter file.
  std::string Head(std::size_t count) const;
  /// Returns all bytes. Throws Error if there are more than `limit_bytes`.
  std::string Text(std::size_t limit_bytes) const;

 private:
  std::string name_;
  std::uint64_t size_ = 0;
  int descriptor_ = -1;
  const std::byte* memory_ = nullptr;
};

/// Little-endian number of at most eight bytes.
std::uint64_t FromLittleEndian(std::string_view bytes);

/// 64-bit FNV-1a hash (Fowler, Noll & Vo) as text.
std::string Checksum(std::string_view bytes);
/// Same for all bytes of a source.
std::string Checksum(const ByteSource& source);

/// Maximum unpacked size of a motion file: hours of capture, but no zip bomb.
inline constexpr std::size_t kMotionTextLimit = std::size_t{1} << 30;

/// Returns the content of a gzipped file. Unpacks it twice, first to check the data and their
/// length, so that memory is allocated once and only for valid data. Throws Error if the file is
/// damaged, truncated or empty, or unpacks to more than `limit_bytes`.
std::vector<std::byte> ReadGzip(const ByteSource& source, std::size_t limit_bytes);

/// Returns the whole file as text, unpacked if gzipped (by content, not by name). Throws Error as
/// ByteSource and ReadGzip do; also if it unpacks to more than ten times the file plus 48 MB.
std::string ReadGzipText(const std::filesystem::path& path,
                         std::size_t limit_bytes = kMotionTextLimit);

/// Returns at most the first `bytes` of the text, to detect formats; empty if unreadable.
std::string ReadGzipHead(const std::filesystem::path& path, std::size_t bytes);

}  // namespace holdfast
