// SPDX-License-Identifier: MIT
#include "geometry/io/container/zip_archive.h"

#include <libdeflate.h>
#include <sys/mman.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

constexpr std::uint32_t kLocalHeader = 0x04034b50;
constexpr std::uint32_t kDirectoryEntry = 0x02014b50;
constexpr std::uint32_t kEnd = 0x06054b50;
constexpr std::uint32_t kEnd64 = 0x06064b50;
constexpr std::uint32_t kEnd64Locator = 0x07064b50;
constexpr std::size_t kLocalHeaderBytes = 30;
constexpr std::size_t kEntryBytes = 46;
constexpr std::size_t kEndBytes = 22;
constexpr std::size_t kEnd64Bytes = 56;
constexpr std::size_t kLocatorBytes = 20;
constexpr std::uint16_t kEncrypted = 1;
constexpr std::uint16_t kStored = 0;
constexpr std::uint16_t kDeflated = 8;

// Deflate cannot expand by more than 1032:1; a member that claims more states a wrong size.
constexpr std::uint64_t kMaxDeflateRatio = 1040;
// Limit for one member: arrays of zeros compress well, but not from a few kilobytes to 10 GB.
constexpr std::uint64_t kUnpackedAllowance = std::uint64_t{256} << 20;
constexpr std::uint64_t kUnpackedPerFileByte = 20;
// Members that claim more are first unpacked without being stored, before memory is allocated.
constexpr std::uint64_t kTrustedUnpackedBytes = std::uint64_t{32} << 20;
constexpr std::size_t kCheckedBytes = std::size_t{4} << 20;
constexpr std::size_t kPackedChunkBytes = std::size_t{64} << 10;
// Members are unpacked at once if memory can also hold their packed bytes.
constexpr std::uint64_t kMaxPackedInOneGo = std::uint64_t{256} << 20;
constexpr std::size_t kLargePageBytes = std::size_t{2} << 20;

// Little-endian number of `bytes` bytes.
std::uint64_t Number(std::span<const std::byte> data, std::size_t at, std::size_t bytes) {
  std::uint64_t value = 0;
  for (std::size_t k = bytes; k-- > 0;)
    value = value << 8 | std::to_integer<std::uint64_t>(data[at + k]);
  return value;
}

struct Directory {
  std::uint64_t offset = 0;  // from the start of the file
  std::uint64_t size = 0;
  std::uint64_t entries = 0;
  std::uint64_t prefix = 0;  // bytes before the archive
};

Error NoArchive(const ByteSource& source, std::string_view detail) {
  return Error(source.Name(),
               fmt::format("is not a .npz (zip) archive, or is cut off ({})", detail),
               "Give a file written by numpy.savez or torch.save, or copy it again");
}

// Locates the directory by the record at the archive's end or, beyond 4 GB, its zip64 version.
Directory FindDirectory(const ByteSource& source) {
  if (source.Size() < kEndBytes) throw NoArchive(source, "too short");
  const std::uint64_t tail_bytes = std::min<std::uint64_t>(source.Size(), kEndBytes + 0xffff);
  std::vector<std::byte> tail(static_cast<std::size_t>(tail_bytes));
  const std::uint64_t tail_offset = source.Size() - tail_bytes;
  source.ReadAt(tail_offset, tail);
  std::size_t at = tail.size() - kEndBytes;
  while (Number(tail, at, 4) != kEnd || Number(tail, at + 20, 2) > tail.size() - at - kEndBytes) {
    if (at == 0) throw NoArchive(source, "no end-of-archive record");
    --at;
  }
  const std::uint64_t end_offset = tail_offset + at;
  if (Number(tail, at + 4, 2) != Number(tail, at + 6, 2) ||
      Number(tail, at + 8, 2) != Number(tail, at + 10, 2)) {
    throw Error(source.Name(), "is one part of a multi-part archive", "Join the parts first");
  }
  Directory found;
  found.entries = Number(tail, at + 10, 2);
  found.size = Number(tail, at + 12, 4);
  found.offset = Number(tail, at + 16, 4);
  std::uint64_t directory_end = end_offset;
  // Some write the zip64 record always (torch), most only if a number exceeds 32 bits.
  if (end_offset >= kLocatorBytes + kEnd64Bytes) {
    std::array<std::byte, kLocatorBytes> locator;
    source.ReadAt(end_offset - kLocatorBytes, locator);
    if (Number(locator, 0, 4) == kEnd64Locator) {
      // The record is right before its locator unless it has extensions: use its stated offset if
      // there is such a record.
      const std::uint64_t stated = Number(locator, 8, 8);
      const std::uint64_t usual = end_offset - kLocatorBytes - kEnd64Bytes;
      std::array<std::byte, kEnd64Bytes> record{};
      directory_end = stated <= usual ? stated : usual;
      source.ReadAt(directory_end, record);
      if (Number(record, 0, 4) != kEnd64) {
        directory_end = usual;
        source.ReadAt(directory_end, record);
      }
      if (Number(record, 0, 4) != kEnd64) throw NoArchive(source, "a damaged zip64 record");
      found.entries = Number(record, 32, 8);
      found.size = Number(record, 40, 8);
      found.offset = Number(record, 48, 8);
    }
  }
  if (found.size > directory_end || found.offset > directory_end - found.size) {
    throw NoArchive(source, "the directory lies outside the file");
  }
  found.prefix = directory_end - found.size - found.offset;
  found.offset += found.prefix;
  if (found.entries > found.size / kEntryBytes) throw NoArchive(source, "a damaged directory");
  return found;
}

// Sizes and an offset beyond 32 bits are in an extra field, in this order, each only if the entry
// has 0xffffffff.
void ReadZip64Extra(std::span<const std::byte> extra, ZipMember& member) {
  for (std::size_t at = 0; at + 4 <= extra.size();) {
    const std::uint64_t id = Number(extra, at, 2);
    const auto length = static_cast<std::size_t>(Number(extra, at + 2, 2));
    at += 4;
    if (length > extra.size() - at) return;
    if (id == 1) {
      std::size_t from = at;
      for (std::uint64_t* value : {&member.size, &member.packed_size, &member.header_offset}) {
        if (*value != 0xffffffff) continue;
        if (from + 8 > at + length) return;
        *value = Number(extra, from, 8);
        from += 8;
      }
      return;
    }
    at += length;
  }
}

// Returns `count` bytes to be filled. Large buffers use large pages if the system has them: most of
// the time to read a stored array is spent by the system on pages of 4 KB.
std::vector<std::byte> LargeBuffer(std::size_t count) {
  std::vector<std::byte> buffer;
  buffer.reserve(count);
#ifdef MADV_HUGEPAGE
  if (count >= kLargePageBytes * 2) {
    const auto begin = reinterpret_cast<std::uintptr_t>(buffer.data());
    const std::uintptr_t first = (begin + kLargePageBytes - 1) / kLargePageBytes * kLargePageBytes;
    const std::uintptr_t last = (begin + count) / kLargePageBytes * kLargePageBytes;
    ::madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);  // only a hint
  }
#endif
  buffer.resize(count);
  return buffer;
}

}  // namespace

ZipArchive::ZipArchive(ByteSource source) : source_(std::move(source)) {
  const Directory found = FindDirectory(source_);
  directory_.resize(static_cast<std::size_t>(found.size));
  source_.ReadAt(found.offset, directory_);
  members_.reserve(static_cast<std::size_t>(found.entries));
  const std::span<const std::byte> bytes(directory_);
  std::size_t at = 0;
  for (std::uint64_t i = 0; i < found.entries; ++i) {
    if (at + kEntryBytes > bytes.size() || Number(bytes, at, 4) != kDirectoryEntry) {
      throw NoArchive(source_, "a damaged directory");
    }
    ZipMember member;
    member.flags = static_cast<std::uint16_t>(Number(bytes, at + 8, 2));
    member.method = static_cast<std::uint16_t>(Number(bytes, at + 10, 2));
    member.checksum = static_cast<std::uint32_t>(Number(bytes, at + 16, 4));
    member.packed_size = Number(bytes, at + 20, 4);
    member.size = Number(bytes, at + 24, 4);
    const auto name_bytes = static_cast<std::size_t>(Number(bytes, at + 28, 2));
    const auto extra_bytes = static_cast<std::size_t>(Number(bytes, at + 30, 2));
    const auto comment_bytes = static_cast<std::size_t>(Number(bytes, at + 32, 2));
    member.header_offset = Number(bytes, at + 42, 4);
    at += kEntryBytes;
    if (name_bytes + extra_bytes + comment_bytes > bytes.size() - at) {
      throw NoArchive(source_, "a damaged directory");
    }
    member.name = {reinterpret_cast<const char*>(bytes.data()) + at, name_bytes};
    ReadZip64Extra(bytes.subspan(at + name_bytes, extra_bytes), member);
    at += name_bytes + extra_bytes + comment_bytes;
    if (member.header_offset > source_.Size() - found.prefix ||
        member.packed_size > source_.Size()) {
      throw Error(fmt::format("{}[{}]", source_.Name(), member.name),
                  "lies outside the file: the archive is cut off", "Copy or save it again");
    }
    member.header_offset += found.prefix;
    members_.push_back(member);
  }
  by_name_.resize(members_.size());
  std::iota(by_name_.begin(), by_name_.end(), 0u);
  std::sort(by_name_.begin(), by_name_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(members_[a].name, a) < std::pair(members_[b].name, b);
  });
  for (std::size_t i = 1; i < by_name_.size(); ++i) {
    ZipMember& one = members_[by_name_[i - 1]];
    ZipMember& other = members_[by_name_[i]];
    if (one.name == other.name) one.ambiguous = other.ambiguous = true;
  }
}

const ZipMember* ZipArchive::Find(std::string_view name) const {
  const auto at = std::ranges::lower_bound(by_name_, name, {},
                                           [&](std::uint32_t i) { return members_[i].name; });
  if (at == by_name_.end() || members_[*at].name != name) return nullptr;
  return &members_[*at];
}

std::vector<std::byte> ZipArchive::Read(const ZipMember& member, const std::string& where,
                                        std::uint64_t limit_bytes) const {
  Stream stream(*this, member, where);
  if (member.size > limit_bytes) {
    throw Error(where, fmt::format("unpacks to {} bytes, more than {}", member.size, limit_bytes),
                "Make the file smaller");
  }
  return stream.ReadRest(static_cast<std::size_t>(member.size));
}

struct ZipArchive::Stream::Inflater {
  Inflater() : packed(kPackedChunkBytes) { good = inflateInit2(&state, -MAX_WBITS) == Z_OK; }
  ~Inflater() { inflateEnd(&state); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  z_stream state{};
  std::vector<std::byte> packed;
  bool good = false;
};

void ZipArchive::Stream::Damaged(std::string_view detail) const {
  throw Error(where_, fmt::format("is damaged or cut off ({})", detail),
              "Copy or save the file again");
}

ZipArchive::Stream::Stream(const ZipArchive& archive, const ZipMember& member, std::string where)
    : source_(archive.source_),
      member_(member),
      where_(std::move(where)),
      packed_left_(member.packed_size) {
  if (member.ambiguous) {
    throw Error(where_, fmt::format("is in the archive twice ('{}')", member.name),
                "Save it again with each name once");
  }
  if ((member.flags & kEncrypted) != 0) {
    throw Error(where_, "is encrypted", "Unpack the archive with its password and pack it again");
  }
  if (member.method != kStored && member.method != kDeflated) {
    throw Error(where_, fmt::format("is packed by method {}", member.method),
                "Pack it again as stored or deflated (numpy.savez, zip)");
  }
  std::array<std::byte, kLocalHeaderBytes> header;
  if (member.header_offset + header.size() > source_.Size()) Damaged("no header");
  source_.ReadAt(member.header_offset, header);
  if (Number(header, 0, 4) != kLocalHeader) Damaged("no header");
  if (Number(header, 8, 2) != member.method || Number(header, 26, 2) != member.name.size()) {
    Damaged("its header and the directory differ");
  }
  begin_ = member.header_offset + header.size() + Number(header, 26, 2) + Number(header, 28, 2);
  position_ = begin_;
  if (position_ > source_.Size() || member.packed_size > source_.Size() - position_) {
    Damaged("it ends outside the file");
  }
  if (member.method == kStored) {
    if (member.size != member.packed_size) Damaged("stored, but of another size");
    return;
  }
  if (member.size / kMaxDeflateRatio > member.packed_size + 1) {
    Damaged(fmt::format("{} bytes packed claim to be {}", member.packed_size, member.size));
  }
  if (member.size > kTrustedUnpackedBytes && member.size / 8 > member.packed_size) {
    if (member.size > kUnpackedAllowance &&
        (member.size - kUnpackedAllowance) / kUnpackedPerFileByte > source_.Size()) {
      throw Error(where_,
                  fmt::format("unpacks to {} MB, out of a file of {} KB", member.size >> 20,
                              source_.Size() >> 10),
                  "If that is right, save it without compression (numpy.savez)");
    }
    std::vector<std::byte> chunk(kPackedChunkBytes);
    inflater_ = std::make_unique<Inflater>();
    while (Remaining() > 0) {
      Read(std::span(chunk).first(
          static_cast<std::size_t>(std::min<std::uint64_t>(Remaining(), chunk.size()))));
    }
    Finish();
    position_ = begin_;
    packed_left_ = member.packed_size;
    delivered_ = 0;
    checksum_ = 0;
  }
  inflater_ = std::make_unique<Inflater>();
}

ZipArchive::Stream::~Stream() = default;

void ZipArchive::Stream::Read(std::span<std::byte> target) {
  if (target.size() > Remaining()) Damaged("ends too early");
  while (!target.empty()) {
    // Pieces that are still in the processor's cache for the checksum.
    const auto piece = target.first(std::min(target.size(), kCheckedBytes));
    if (member_.method == kStored) {
      source_.ReadAt(position_, piece);
      position_ += piece.size();
      packed_left_ -= piece.size();
    } else {
      Inflate(piece);
    }
    checksum_ = libdeflate_crc32(checksum_, piece.data(), piece.size());
    delivered_ += piece.size();
    target = target.subspan(piece.size());
  }
}

void ZipArchive::Stream::Inflate(std::span<std::byte> target) {
  z_stream& state = inflater_->state;
  if (!inflater_->good) Damaged("no memory to unpack it");
  state.next_out = reinterpret_cast<Bytef*>(target.data());
  state.avail_out = static_cast<uInt>(target.size());
  while (state.avail_out > 0) {
    if (state.avail_in == 0 && packed_left_ > 0) {
      const auto count =
          static_cast<std::size_t>(std::min<std::uint64_t>(packed_left_, inflater_->packed.size()));
      source_.ReadAt(position_, std::span(inflater_->packed).first(count));
      position_ += count;
      packed_left_ -= count;
      state.next_in = reinterpret_cast<Bytef*>(inflater_->packed.data());
      state.avail_in = static_cast<uInt>(count);
    }
    const int status = inflate(&state, Z_NO_FLUSH);
    if (status == Z_STREAM_END && state.avail_out == 0) return;
    if (status != Z_OK) Damaged(status == Z_STREAM_END ? "ends too early" : "bad packed data");
  }
}

// Unpacks the whole member. Returns false on any failure, which Read() then reports.
bool ZipArchive::Stream::InflateWhole(std::span<std::byte> target) const {
  const auto count = static_cast<std::size_t>(member_.packed_size);
  std::vector<std::byte> packed = LargeBuffer(count);
  source_.ReadAt(begin_, packed);
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> inflater(
      libdeflate_alloc_decompressor(), &libdeflate_free_decompressor);
  return inflater != nullptr &&
         libdeflate_deflate_decompress(inflater.get(), packed.data(), count, target.data(),
                                       target.size(), nullptr) == LIBDEFLATE_SUCCESS &&
         libdeflate_crc32(0, target.data(), target.size()) == member_.checksum;
}

std::vector<std::byte> ZipArchive::Stream::ReadRest(std::size_t count) {
  if (count > Remaining()) Damaged("ends too early");
  const bool in_one_go = member_.method == kDeflated && count > 0 && count == Remaining() &&
                         member_.packed_size <= kMaxPackedInOneGo;
  std::vector<std::byte> data =
      LargeBuffer(in_one_go ? static_cast<std::size_t>(member_.size) : count);
  if (in_one_go && InflateWhole(data)) {
    data.erase(data.begin(), data.begin() + static_cast<std::ptrdiff_t>(delivered_));
    delivered_ = member_.size;
    return data;
  }
  data.resize(count);
  Read(data);
  Finish();
  return data;
}

void ZipArchive::Stream::Finish() {
  if (Remaining() > 0) Damaged("more data than needed");
  if (checksum_ != member_.checksum) Damaged("checksum");
}

}  // namespace holdfast
