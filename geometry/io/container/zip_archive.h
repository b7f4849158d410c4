// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/io/container/byte_source.h"

namespace holdfast {

/// One member of a zip archive, as listed in the archive's directory.
struct ZipMember {
  std::string_view name;  ///< valid as long as the archive; only a name, never a place on disk
  std::uint64_t size = 0;
  std::uint64_t packed_size = 0;
  std::uint64_t header_offset = 0;  ///< from the start of the file
  std::uint32_t checksum = 0;       ///< CRC-32
  std::uint16_t method = 0;         ///< 0 stored, 8 deflated
  std::uint16_t flags = 0;
  bool ambiguous = false;  ///< another member has the same name
};

/// Reads zip archives (APPNOTE 6.3): stored and deflated members, zip64, data before the archive.
/// Only the directory is kept in memory; members are read on demand, without a copy. Sizes that an
/// archive states are not trusted before they are checked.
class ZipArchive {
 public:
  /// Throws Error if it is not a zip archive, is truncated, or its directory is damaged.
  explicit ZipArchive(ByteSource source);

  const std::vector<ZipMember>& Members() const { return members_; }
  const ZipMember* Find(std::string_view name) const;
  const ByteSource& Source() const { return source_; }

  /// Reads a member from start to end.
  class Stream {
   public:
    /// Throws Error, named `where`, for a member that is encrypted, packed by another method, in
    /// the archive twice, or unpacks to more than its archive can justify.
    Stream(const ZipArchive& archive, const ZipMember& member, std::string where);
    ~Stream();
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;

    std::uint64_t Remaining() const { return member_.size - delivered_; }
    /// Fills `target`. Throws Error if the member ends earlier or is damaged.
    void Read(std::span<std::byte> target);
    /// Throws Error unless all bytes are read and the checksum is right.
    void Finish();
    /// Returns the last `count` bytes, which must be all that remain: equals Read() and Finish(),
    /// but about three times as fast for a packed member.
    std::vector<std::byte> ReadRest(std::size_t count);

   private:
    struct Inflater;
    [[noreturn]] void Damaged(std::string_view detail) const;
    void Inflate(std::span<std::byte> target);
    bool InflateWhole(std::span<std::byte> target) const;

    const ByteSource& source_;
    const ZipMember& member_;
    std::string where_;
    std::uint64_t begin_ = 0;     // start of the packed bytes in the file
    std::uint64_t position_ = 0;  // next packed byte in the file
    std::uint64_t packed_left_ = 0;
    std::uint64_t delivered_ = 0;
    std::uint32_t checksum_ = 0;
    std::unique_ptr<Inflater> inflater_;
  };

  /// Returns the whole member. Throws Error as Stream does, and for more than `limit_bytes`.
  std::vector<std::byte> Read(const ZipMember& member, const std::string& where,
                              std::uint64_t limit_bytes) const;

 private:
  ByteSource source_;
  std::vector<std::byte> directory_;
  std::vector<ZipMember> members_;      // in the directory's order
  std::vector<std::uint32_t> by_name_;  // indices into members_, sorted by name
};

}  // namespace holdfast
