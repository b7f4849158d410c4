// SPDX-License-Identifier: MIT
#include "geometry/io/container/gzip.h"

#include <zlib.h>

#include <algorithm>
#include <span>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

constexpr std::size_t kGzipPieceBytes = std::size_t{64} << 10;
constexpr std::size_t kAlwaysBytes = std::size_t{48} << 20;
constexpr int kGzipOnly = 16;  // added to zlib's window size
constexpr std::string_view kMagic = "\x1f\x8b";

struct Inflater {
  Inflater() { good = inflateInit2(&state, MAX_WBITS + kGzipOnly) == Z_OK; }
  ~Inflater() { inflateEnd(&state); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  z_stream state{};
  bool good = false;
};

// Calls `take` with piece after piece of what is unpacked, until it returns false. A file may be
// several one after another.
template <typename Take>
void Unpack(const ByteSource& source, Take&& take) {
  const auto damaged = [&](std::string_view detail) {
    return Error(source.Name(), fmt::format("holds damaged gzip data ({})", detail),
                 "Fetch the file again");
  };
  Inflater inflater;
  if (!inflater.good) throw damaged("no memory to unpack it");
  z_stream& state = inflater.state;
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
      // Zeros may fill a file up to some block's size.
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
  if (bytes == 0) throw Error(source.Name(), "holds nothing", "Save it again");
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
  // A text of motion packs to a tenth at best; a small one may be anything.
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
