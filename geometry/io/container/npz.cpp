// SPDX-License-Identifier: MIT
#include "geometry/io/container/npz.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zip.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/json_file.h"
#include "geometry/io/container/npy_header.h"
#include "geometry/io/container/zip_archive.h"

namespace holdfast {
namespace {

constexpr std::string_view kEnding = ".npy";
constexpr std::size_t kNamesInMessage = 40;

// numpy.savez adds the suffix; archives packed by other means may lack it.
const ZipMember* FindMember(const ZipArchive& archive, std::string_view key) {
  if (const ZipMember* member = archive.Find(fmt::format("{}{}", key, kEnding))) return member;
  const ZipMember* member = archive.Find(key);
  return member != nullptr && !member->name.ends_with('/') ? member : nullptr;
}

const ZipMember& RequireMember(const NpzReader& reader, const ZipArchive& archive,
                               std::string_view key, const std::string& where) {
  if (const ZipMember* member = FindMember(archive, key)) return *member;
  std::vector<std::string> keys = reader.Keys();
  const std::size_t count = keys.size();
  keys.resize(std::min(count, kNamesInMessage));
  throw Error(where, "is missing",
              fmt::format("The file has: {}{}", fmt::join(keys, ", "),
                          count > keys.size() ? fmt::format(", ... ({})", count) : ""));
}

// One member of the archive, read up to its data.
struct OpenMember {
  OpenMember(const NpzReader& reader, const ZipArchive& archive, std::string_view key,
             bool allow_objects)
      : where(fmt::format("{}[{}]", reader.Path().string(), key)),
        stream(archive, RequireMember(reader, archive, key, where), where),
        array(ReadNpyStart([this](std::span<std::byte> target) { stream.Read(target); }, where,
                           allow_objects)) {}

  std::string where;
  ZipArchive::Stream stream;
  NpyArray array;
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
  OpenMember member(*this, *archive_, key, true);
  return {member.where, std::move(member.array)};
}

NpyMember NpzReader::Read(std::string_view key) const {
  OpenMember member(*this, *archive_, key, false);
  member.array.data =
      member.stream.ReadRest(NpyDataBytes(member.array, member.stream.Remaining(), member.where));
  return {member.where, std::move(member.array)};
}

std::vector<std::byte> NpzReader::ReadPickle(std::string_view key, std::size_t limit_bytes) const {
  OpenMember member(*this, *archive_, key, true);
  if (member.array.kind != 'O') {
    throw Error(member.where, "holds no Python objects", "Read it as an array");
  }
  const std::uint64_t bytes = member.stream.Remaining();
  if (bytes > limit_bytes) {
    throw Error(member.where,
                fmt::format("holds {} bytes of Python objects, more than {}", bytes, limit_bytes),
                "Save plain arrays");
  }
  return member.stream.ReadRest(static_cast<std::size_t>(bytes));
}

void NpzWriter::AddFloat32(std::string key, std::vector<std::size_t> shape,
                           std::vector<float> values) {
  Add(std::move(key), MakeNpyArray('f', std::move(shape), values));
}

void NpzWriter::AddFloat64(std::string key, std::vector<std::size_t> shape,
                           std::vector<double> values) {
  Add(std::move(key), MakeNpyArray('f', std::move(shape), values));
}

void NpzWriter::AddFloat16(std::string key, std::vector<std::size_t> shape,
                           const std::vector<float>& values) {
  const std::vector<std::uint16_t> halves = ToHalves(values, key, "half precision");
  Add(std::move(key), MakeNpyArray('f', std::move(shape), halves));
}

void NpzWriter::AddInt64(std::string key, std::vector<std::size_t> shape,
                         std::vector<std::int64_t> values) {
  Add(std::move(key), MakeNpyArray('i', std::move(shape), values));
}

void NpzWriter::AddUint8(std::string key, std::vector<std::size_t> shape,
                         std::vector<std::uint8_t> values) {
  Add(std::move(key), MakeNpyArray('u', std::move(shape), values));
}

namespace {

// UTF-8 to UCS-4; malformed bytes become U+FFFD instead of a broken file.
std::vector<std::uint32_t> CodesOf(std::string_view bytes) {
  const std::string text = AsUtf8(bytes);
  std::vector<std::uint32_t> codes;
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const std::size_t length = lead < 0x80       ? 1
                               : lead >> 5 == 6  ? 2
                               : lead >> 4 == 14 ? 3
                               : lead >> 3 == 30 ? 4
                                                 : 0;
    std::uint32_t code = length == 1   ? lead
                         : length == 2 ? lead & 0x1fu
                         : length == 3 ? lead & 0xfu
                                       : lead & 7u;
    bool good = length > 0 && i + length <= text.size();
    for (std::size_t k = 1; good && k < length; ++k) {
      const auto c = static_cast<unsigned char>(text[i + k]);
      good = c >> 6 == 2;
      code = code << 6 | (c & 0x3fu);
    }
    codes.push_back(good ? code : 0xfffdu);
    i += good ? length : 1;
  }
  return codes;
}

}  // namespace

void NpzWriter::AddText(std::string key, std::string_view text) {
  AddTexts(key, {std::string(text)});
  arrays_.at(key).shape.clear();
}

void NpzWriter::AddTexts(std::string key, const std::vector<std::string>& texts) {
  std::vector<std::vector<std::uint32_t>> all;
  std::size_t longest = 1;
  for (const std::string& text : texts) {
    longest = std::max(longest, all.emplace_back(CodesOf(text)).size());
  }
  std::vector<std::uint32_t> codes;
  for (std::vector<std::uint32_t>& text : all) {
    text.resize(longest);  // padded with zeros
    codes.insert(codes.end(), text.begin(), text.end());
  }
  NpyArray array = MakeNpyArray('U', {texts.size()}, codes);
  array.item_size = longest * sizeof(std::uint32_t);
  Add(std::move(key), std::move(array));
}

void NpzWriter::Add(std::string key, NpyArray array) {
  const std::size_t bytes = array.NumElements() * array.item_size;
  if (array.data.size() != bytes) {
    throw Error("npz",
                fmt::format("{} bytes for shape ({}) of {} bytes each", array.data.size(),
                            fmt::join(array.shape, ", "), array.item_size),
                "");
  }
  arrays_.insert_or_assign(std::move(key), std::move(array));
}

void NpzWriter::Write(const std::filesystem::path& path) const {
  WriteAtomically(path, [&](const std::filesystem::path& temporary) {
    const auto fail = [&](std::string_view reason) {
      return Error(path.string(), fmt::format("could not be written ({})", reason),
                   "Free some space or choose another folder");
    };
    int code = 0;
    zip_t* zip = zip_open(temporary.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code);
    if (zip == nullptr) throw fail("cannot be created");
    std::vector<std::string> members;  // libzip reads them when the archive is closed
    members.reserve(arrays_.size());
    for (const auto& [key, array] : arrays_) {
      members.push_back(EncodeNpy(array));
      zip_source_t* source =
          zip_source_buffer(zip, members.back().data(), members.back().size(), 0);
      const auto index = zip_file_add(zip, (key + ".npy").c_str(), source, ZIP_FL_ENC_UTF_8);
      if (index < 0) {
        zip_source_free(source);
        const std::string reason = zip_strerror(zip);
        zip_discard(zip);
        throw fail(reason);
      }
      const auto id = static_cast<zip_uint64_t>(index);
      zip_set_file_compression(zip, id, ZIP_CM_DEFLATE, 6);
      zip_file_set_dostime(zip, id, 0, (1 << 5) | 1, 0);  // 1980-01-01: same arrays, same bytes
    }
    if (zip_close(zip) != 0) {
      const std::string reason = zip_strerror(zip);
      zip_discard(zip);
      throw fail(reason);
    }
  });
}

}  // namespace holdfast
