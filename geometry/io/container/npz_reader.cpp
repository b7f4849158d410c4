// SPDX-License-Identifier: MIT
#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/npy_header.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/container/zip_archive.h"

namespace holdfast {
namespace {

constexpr std::string_view kEnding = ".npy";
constexpr std::size_t kNamesInMessage = 40;

// numpy.savez adds the ending; archives packed by other means may lack it.
const ZipMember* FindMember(const ZipArchive& archive, std::string_view key) {
  if (const ZipMember* member = archive.Find(fmt::format("{}{}", key, kEnding))) return member;
  const ZipMember* member = archive.Find(key);
  return member != nullptr && !member->name.ends_with('/') ? member : nullptr;
}

// One member of the archive, opened up to its data.
class OpenMember {
 public:
  OpenMember(const NpzReader& reader, const ZipArchive& archive, std::string_view key,
             NpyObjects objects)
      : where_(fmt::format("{}[{}]", reader.Path().string(), key)),
        stream_(archive, Locate(reader, archive, key), where_),
        start_(ReadNpyStart([this](std::span<std::byte> target) { stream_.Read(target); }, where_,
                            objects)) {}

  const std::string& Where() const { return where_; }
  ZipArchive::Stream& Stream() { return stream_; }
  NpyArray& Array() { return start_.array; }

 private:
  const ZipMember& Locate(const NpzReader& reader, const ZipArchive& archive,
                          std::string_view key) const {
    if (const ZipMember* member = FindMember(archive, key)) return *member;
    std::vector<std::string> keys = reader.Keys();
    const std::size_t count = keys.size();
    keys.resize(std::min(count, kNamesInMessage));
    throw Error(where_, "is missing",
                fmt::format("The file has: {}{}", fmt::join(keys, ", "),
                            count > keys.size() ? fmt::format(", ... ({})", count) : ""));
  }

  std::string where_;
  ZipArchive::Stream stream_;
  NpyStart start_;
};

}  // namespace

NpzReader::NpzReader(const std::filesystem::path& path)
    : path_(path), archive_(std::make_unique<ZipArchive>(ByteSource(path))) {}

NpzReader::NpzReader(std::span<const std::byte> bytes, std::string name)
    : path_(name), archive_(std::make_unique<ZipArchive>(ByteSource(bytes, std::move(name)))) {}

NpzReader::NpzReader(std::unique_ptr<const ZipArchive> archive)
    : path_(archive->Source().Name()), archive_(std::move(archive)) {}

NpzReader::~NpzReader() = default;
NpzReader::NpzReader(NpzReader&&) noexcept = default;
NpzReader& NpzReader::operator=(NpzReader&&) noexcept = default;

std::uint64_t NpzReader::SizeBytes() const { return archive_->Source().Size(); }

bool NpzReader::Has(std::string_view key) const { return FindMember(*archive_, key) != nullptr; }

std::vector<std::string> NpzReader::Keys() const {
  std::vector<std::string> keys;
  for (const ZipMember& member : archive_->Members()) {
    std::string_view name = member.name;
    if (name.ends_with('/')) continue;  // a folder
    if (name.ends_with(kEnding)) name.remove_suffix(kEnding.size());
    keys.emplace_back(name);
  }
  return keys;
}

NpyMember NpzReader::ReadHeader(std::string_view key) const {
  OpenMember member(*this, *archive_, key, NpyObjects::kAllowed);
  return {member.Where(), std::move(member.Array())};
}

NpyMember NpzReader::Read(std::string_view key) const {
  OpenMember member(*this, *archive_, key, NpyObjects::kRefused);
  ZipArchive::Stream& stream = member.Stream();
  NpyArray& array = member.Array();
  array.data = stream.ReadRest(NpyDataBytes(array, stream.Remaining(), member.Where()));
  return {member.Where(), std::move(array)};
}

std::vector<std::byte> NpzReader::ReadPickle(std::string_view key, std::size_t limit_bytes) const {
  OpenMember member(*this, *archive_, key, NpyObjects::kAllowed);
  if (member.Array().kind != 'O') {
    throw Error(member.Where(), "holds no Python objects", "Read it as an array");
  }
  ZipArchive::Stream& stream = member.Stream();
  if (stream.Remaining() > limit_bytes) {
    throw Error(member.Where(),
                fmt::format("holds {} bytes of Python objects, more than {}", stream.Remaining(),
                            limit_bytes),
                "Save plain arrays");
  }
  return stream.ReadRest(static_cast<std::size_t>(stream.Remaining()));
}

}  // namespace holdfast
