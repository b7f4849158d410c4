// SPDX-License-Identifier: MIT
#include "geometry/io/container/byte_source.h"

#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <zlib.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

constexpr std::size_t kLargestRead = std::size_t{1} << 30;  // Linux reads less than 2^31 at once

}  // namespace

ByteSource::ByteSource(const std::filesystem::path& path) : name_(path.string()) {
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  const int reason = errno;
  const auto refuse = [&](std::string_view problem, std::string_view remedy) {
    if (descriptor_ >= 0) ::close(descriptor_);
    throw Error(name_, problem, remedy);
  };
  if (descriptor_ < 0 && (reason == ENOENT || reason == ENOTDIR)) {
    refuse("does not exist", "Check the path");
  }
  if (descriptor_ < 0 && reason == ELOOP) refuse("is a loop of symbolic links", "Check the path");
  if (descriptor_ < 0) {
    refuse(fmt::format("cannot be opened ({})", std::strerror(reason)), "Check the permissions");
  }
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) refuse("cannot be read", "Check the path");
  if (S_ISDIR(status.st_mode))
    refuse("is a folder, but a file is needed", "Name the file inside it");
  if (!S_ISREG(status.st_mode)) refuse("is not a regular file", "Save it to a file first");
  if (status.st_size == 0) refuse("is empty", "Copy or save it again");
  size_ = static_cast<std::uint64_t>(status.st_size);
}

ByteSource::ByteSource(std::span<const std::byte> bytes, std::string name)
    : name_(std::move(name)), size_(bytes.size()), memory_(bytes.data()) {}

ByteSource::~ByteSource() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

ByteSource::ByteSource(ByteSource&& other) noexcept
    : name_(std::move(other.name_)),
      size_(std::exchange(other.size_, 0)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      memory_(std::exchange(other.memory_, nullptr)) {}

ByteSource& ByteSource::operator=(ByteSource&& other) noexcept {
  std::swap(name_, other.name_);
  std::swap(size_, other.size_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(memory_, other.memory_);
  return *this;
}

void ByteSource::ReadAt(std::uint64_t offset, std::span<std::byte> target) const {
  const auto cut_off = [&] {
    return Error(name_, fmt::format("ends at byte {}, before all of its data", size_),
                 "It is cut off: copy or save it again");
  };
  if (offset > size_ || target.size() > size_ - offset) throw cut_off();
  if (target.empty()) return;
  if (descriptor_ < 0) {
    std::memcpy(target.data(), memory_ + offset, target.size());
    return;
  }
  while (!target.empty()) {
    const auto got = ::pread(descriptor_, target.data(), std::min(target.size(), kLargestRead),
                             static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      throw Error(name_, fmt::format("cannot be read ({})", std::strerror(errno)),
                  "Check the disk");
    }
    if (got == 0) throw cut_off();  // truncated during reading
    offset += static_cast<std::uint64_t>(got);
    target = target.subspan(static_cast<std::size_t>(got));
  }
}

std::string ByteSource::Head(std::size_t count) const {
  std::string head(static_cast<std::size_t>(std::min<std::uint64_t>(count, size_)), '\0');
  ReadAt(0, std::as_writable_bytes(std::span(head)));
  return head;
}

std::string ByteSource::Text(std::size_t limit_bytes) const {
  if (size_ > limit_bytes) {
    throw Error(name_, fmt::format("is larger than {} bytes", limit_bytes),
                "Check that it is the right file");
  }
  return Head(size_);
}

std::uint64_t FromLittleEndian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) {
    value = value << 8 | static_cast<unsigned char>(bytes[i]);
  }
  return value;
}

std::string Checksum(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325ull;
  for (const char c : bytes) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  }
  return fmt::format("{:016x}", hash);
}

std::string Checksum(const ByteSource& source) { return Checksum(source.Head(source.Size())); }

namespace {

constexpr std::size_t kGzipPieceBytes = std::size_t{64} << 10;
constexpr std::size_t kAlwaysBytes = std::size_t{48} << 20;
constexpr int kGzipOrZlib = 32;  // added to zlib's window size
constexpr std::string_view kMagic = "\x1f\x8b";

// Calls `take` with consecutive unpacked pieces until it returns false. A file may consist of
// several gzip members.
template <typename Take>
void Unpack(const ByteSource& source, Take&& take) {
  const auto damaged = [&](std::string_view detail) {
    return Error(source.Name(), fmt::format("holds damaged gzip data ({})", detail),
                 "Fetch the file again");
  };
  z_stream state{};
  if (inflateInit2(&state, MAX_WBITS + kGzipOrZlib) != Z_OK)
    throw damaged("no memory to unpack it");
  const std::unique_ptr<z_stream, decltype(&inflateEnd)> end_inflate(&state, &inflateEnd);
  std::vector<std::byte> packed(kGzipPieceBytes), piece(kGzipPieceBytes);
  std::uint64_t at = 0;
  bool at_end = false;
  while (true) {
    if (state.avail_in == 0) {
      const auto count =
          static_cast<std::size_t>(std::min<std::uint64_t>(packed.size(), source.Size() - at));
      if (count == 0 && at_end) return;
      if (count == 0) throw damaged("it ends too early");
      source.ReadAt(at, std::span(packed).first(count));
      at += count;
      state.next_in = reinterpret_cast<Bytef*>(packed.data());
      state.avail_in = static_cast<uInt>(count);
    }
    if (at_end) {
      // Zeros may pad a file to a block size.
      if (state.next_in[0] == 0) return;
      inflateReset(&state);
      at_end = false;
    }
    state.next_out = reinterpret_cast<Bytef*>(piece.data());
    state.avail_out = static_cast<uInt>(piece.size());
    const int status = inflate(&state, Z_NO_FLUSH);
    if (status != Z_OK && status != Z_STREAM_END && status != Z_BUF_ERROR) {
      throw damaged(state.msg != nullptr ? state.msg : "not gzip");
    }
    if (!take(std::span<const std::byte>(piece).first(piece.size() - state.avail_out))) return;
    at_end = status == Z_STREAM_END;
  }
}

// Content: a vector of bytes or a string.
template <typename Content>
Content Unpacked(const ByteSource& source, std::size_t limit_bytes) {
  std::size_t bytes = 0;
  Unpack(source, [&](std::span<const std::byte> piece) {
    if (piece.size() > limit_bytes - bytes) {
      throw Error(source.Name(),
                  fmt::format("unpacks from {} KB to more than {} MB", source.Size() >> 10,
                              limit_bytes >> 20),
                  "If that is right, unpack it first (gunzip)");
    }
    bytes += piece.size();
    return true;
  });
  if (bytes == 0) throw Error(source.Name(), "is empty after unpacking", "Save it again");
  Content content;
  content.reserve(bytes);
  using Value = typename Content::value_type;
  Unpack(source, [&](std::span<const std::byte> piece) {
    if (piece.size() <= bytes - content.size()) {
      const auto* const begin = reinterpret_cast<const Value*>(piece.data());
      content.insert(content.end(), begin, begin + piece.size());
    }
    return true;
  });
  return content;
}

}  // namespace

std::vector<std::byte> ReadGzip(const ByteSource& source, std::size_t limit_bytes) {
  return Unpacked<std::vector<std::byte>>(source, limit_bytes);
}

std::string ReadGzipText(const std::filesystem::path& path, std::size_t limit_bytes) {
  const ByteSource source(path);
  if (source.Head(kMagic.size()) != kMagic) return source.Text(limit_bytes);
  // A motion text compresses to a tenth at best; a small file may be anything.
  return Unpacked<std::string>(
      source, std::min<std::uint64_t>(limit_bytes, kAlwaysBytes + 10 * source.Size()));
}

std::string ReadGzipHead(const std::filesystem::path& path, std::size_t bytes) {
  try {
    const ByteSource source(path);
    if (source.Head(kMagic.size()) != kMagic) return source.Head(bytes);
    std::string head;
    Unpack(source, [&](std::span<const std::byte> piece) {
      head.append(reinterpret_cast<const char*>(piece.data()),
                  std::min(piece.size(), bytes - head.size()));
      return head.size() < bytes;
    });
    return head;
  } catch (const Error&) {
    return {};
  }
}

}  // namespace holdfast
