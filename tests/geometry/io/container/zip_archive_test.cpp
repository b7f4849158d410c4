// SPDX-License-Identifier: MIT
// A member read in one go is what it is read piece by piece, whatever is done to it.
#include "geometry/io/container/zip_archive.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>
#include <span>
#include <string>

#include "geometry/error.h"
#include "tests/support/peak_memory.h"
#include "tests/support/zip_bytes.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::LittleEndian;
using testing::ZipBytes;
using testing::ZipPart;

constexpr std::size_t kHead = 10;

// What a reader makes of the archive's first member, after `kHead` bytes of it: its text, or what
// is thrown.
std::string Outcome(const std::string& archive,
                    const std::function<std::string(ZipArchive::Stream&)>& read) {
  try {
    const ZipArchive zip(ByteSource(std::as_bytes(std::span(archive)), "a.zip"));
    if (zip.Members().empty()) return "no member";
    ZipArchive::Stream stream(zip, zip.Members().front(), "member");
    std::string head(kHead, '\0');
    stream.Read(std::as_writable_bytes(std::span(head)));
    return head + read(stream);
  } catch (const Error& error) {
    return std::string("Error: ") + error.what();
  }
}

std::string InOneGo(const std::string& archive) {
  return Outcome(archive, [](ZipArchive::Stream& stream) {
    const auto rest = stream.ReadRest(static_cast<std::size_t>(stream.Remaining()));
    EXPECT_EQ(stream.Remaining(), 0u);
    return std::string(reinterpret_cast<const char*>(rest.data()), rest.size());
  });
}

std::string PieceByPiece(const std::string& archive) {
  return Outcome(archive, [](ZipArchive::Stream& stream) {
    std::string text;
    while (stream.Remaining() > 0) {
      std::string piece(std::min<std::size_t>(777, stream.Remaining()), '\0');
      stream.Read(std::as_writable_bytes(std::span(piece)));
      text += piece;
    }
    stream.Finish();
    return text;
  });
}

// Text that packs about five to one.
std::string Words(std::size_t count) {
  std::mt19937 random(7);
  std::string text;
  while (text.size() < count) text += "word " + std::to_string(random() % 100) + ' ';
  text.resize(count);
  return text;
}

TEST(ZipArchive, AMemberInOneGoIsItsPieces) {
  for (const int method : {0, 8}) {
    for (const std::size_t count : {kHead, kHead + 1, std::size_t{5000}, std::size_t{300'000}}) {
      const std::string text = Words(count);
      const std::string archive =
          ZipBytes({{.name = "x", .content = text, .method = method}}, "data before");
      EXPECT_EQ(InOneGo(archive), text) << method;
      EXPECT_EQ(PieceByPiece(archive), text) << method;
    }
  }
}

TEST(ZipArchive, EveryFlippedByteIsToldAlike) {
  const std::string text = Words(3000);
  const std::string archive = ZipBytes({{.name = "x", .content = text, .method = 8}});
  int refused = 0;
  for (std::size_t i = 0; i < archive.size(); ++i) {
    for (const int mask : {1, 0x80}) {
      std::string bad = archive;
      bad[i] = static_cast<char>(bad[i] ^ mask);
      const std::string outcome = InOneGo(bad);
      EXPECT_EQ(outcome, PieceByPiece(bad)) << i;
      if (outcome != text) ++refused;
    }
  }
  EXPECT_GT(refused, static_cast<int>(archive.size()));
}

TEST(ZipArchive, LiesAboutSizesAreToldAlike) {
  const std::string text = Words(3000);
  for (const int more : {-500, -1, 0, 1, 500}) {
    const ZipPart part{
        .name = "x", .content = text, .method = 8, .size = static_cast<std::uint64_t>(3000 + more)};
    const std::string archive = ZipBytes({part});
    EXPECT_EQ(InOneGo(archive), PieceByPiece(archive)) << more;
    EXPECT_EQ(InOneGo(archive) == text, more == 0) << more;
  }
  // Packed bytes that end before the end of the data, and ones that go on after it.
  const std::string archive = ZipBytes({{.name = "x", .content = text, .method = 8}});
  const std::size_t packed = testing::Deflated(text).size();
  const std::size_t directory = archive.find("PK\x01\x02");
  ASSERT_NE(directory, std::string::npos);
  for (const int more : {-300, -4, -1, 1, 20}) {
    std::string bad = archive;
    bad.replace(directory + 20, 4, LittleEndian(packed + static_cast<std::size_t>(more), 4));
    EXPECT_EQ(InOneGo(bad), PieceByPiece(bad)) << more;
    if (more < -4) {
      EXPECT_THAT(InOneGo(bad), HasSubstr("bad packed data")) << more;
    }
  }
}

TEST(ZipArchive, ReadsNoMoreThanWhatRemains) {
  const std::string archive = ZipBytes({{.name = "x", .content = Words(3000), .method = 8}});
  const auto rest_of = [&](std::size_t count) {
    return Outcome(archive, [&](ZipArchive::Stream& stream) {
      stream.ReadRest(count);
      return std::string();
    });
  };
  EXPECT_THAT(rest_of(3000 - kHead + 1), HasSubstr("ends too early"));
  EXPECT_THAT(rest_of(3000 - kHead - 1), HasSubstr("more data than needed"));
}

TEST(ZipArchive, UnpacksInOneGoWithinThePackedAndTheUnpackedBytes) {
  constexpr std::size_t kBytes = std::size_t{48} << 20;
  std::mt19937 random(3);
  std::string noise(kBytes, '\0');  // packs little: the memory of both counts
  for (char& c : noise) c = static_cast<char>(random() % 64);
  const std::string archive = ZipBytes({{.name = "x", .content = noise, .method = 8}});
  const ZipArchive zip(ByteSource(std::as_bytes(std::span(archive)), "a.zip"));
  const testing::PeakMemory memory;
  const auto data = zip.Read(zip.Members().front(), "member", kBytes);
  const auto growth = memory.Growth();
  EXPECT_TRUE(std::ranges::equal(data, std::as_bytes(std::span(noise))));
  if (!growth) GTEST_SKIP() << "the peak of memory cannot be read here";
  EXPECT_LT(*growth, kBytes + archive.size() + (std::size_t{8} << 20));
}

}  // namespace
}  // namespace holdfast
