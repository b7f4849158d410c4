// SPDX-License-Identifier: MIT
#include <zip.h>

#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/io/npy_header.h"
#include "geometry/io/npz.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxHeaderBytes = 1 << 16;
constexpr std::size_t kMaxMemberBytes = std::size_t{16} << 30;
// Deflate cannot expand by more than 1032:1; a member that claims more is lying about its size.
constexpr std::size_t kMaxDeflateRatio = 1040;

std::optional<std::size_t> CheckedProduct(const std::vector<std::size_t>& shape,
                                          std::size_t item_size) {
  std::size_t bytes = item_size;
  for (const std::size_t n : shape) {
    if (n != 0 && bytes > kMaxMemberBytes / n) return std::nullopt;
    bytes *= n;
  }
  return bytes;
}

struct ZipCloser {
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};

}  // namespace

struct NpzReader::Archive {
  zip_t* zip = nullptr;
};

NpzReader::NpzReader(const fs::path& path) : path_(path) {
  std::error_code error;
  if (!fs::exists(path, error)) throw Error(path.string(), "does not exist", "Check the path");
  if (fs::is_directory(path, error)) {
    throw Error(path.string(), "is a folder, a .npz file is needed", "Name the file inside it");
  }
  if (fs::file_size(path, error) == 0 && !error) {
    throw Error(path.string(), "is empty", "Copy or save it again");
  }
  int code = 0;
  zip_t* zip = zip_open(path.c_str(), ZIP_RDONLY, &code);
  if (zip == nullptr) {
    zip_error_t reason;
    zip_error_init_with_code(&reason, code);
    const std::string text = zip_error_strerror(&reason);
    zip_error_fini(&reason);
    throw Error(path.string(), fmt::format("is not a .npz (zip) archive, or is cut off ({})", text),
                "Give a file written by numpy.savez, or copy it again");
  }
  archive_ = new Archive{zip};
}

NpzReader::NpzReader(std::span<const std::byte> bytes, std::string name) : path_(std::move(name)) {
  zip_error_t reason;
  zip_error_init(&reason);
  zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &reason);
  zip_t* zip = source == nullptr ? nullptr : zip_open_from_source(source, ZIP_RDONLY, &reason);
  if (zip == nullptr) {
    if (source != nullptr) zip_source_free(source);
    const std::string text = zip_error_strerror(&reason);
    zip_error_fini(&reason);
    throw Error(path_.string(), fmt::format("is not a .npz (zip) archive ({})", text),
                "Give an archive written by numpy.savez");
  }
  zip_error_fini(&reason);
  archive_ = new Archive{zip};
}

NpzReader::~NpzReader() {
  if (archive_ == nullptr) return;
  zip_discard(archive_->zip);
  delete archive_;
}

NpzReader::NpzReader(NpzReader&& other) noexcept
    : path_(std::move(other.path_)), archive_(std::exchange(other.archive_, nullptr)) {}

NpzReader& NpzReader::operator=(NpzReader&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(archive_, other.archive_);
  return *this;
}

bool NpzReader::Has(std::string_view key) const {
  return zip_name_locate(archive_->zip, fmt::format("{}.npy", key).c_str(), 0) >= 0;
}

std::vector<std::string> NpzReader::Keys() const {
  std::vector<std::string> keys;
  const auto count = zip_get_num_entries(archive_->zip, 0);
  for (zip_int64_t i = 0; i < count; ++i) {
    const char* name = zip_get_name(archive_->zip, static_cast<zip_uint64_t>(i), 0);
    if (name == nullptr) continue;
    const std::string_view view(name);
    if (view.ends_with(".npy")) keys.emplace_back(view.substr(0, view.size() - 4));
  }
  return keys;
}

NpyMember NpzReader::Read(std::string_view key) const {
  const std::string where = fmt::format("{}[{}]", path_.string(), key);
  const auto index = zip_name_locate(archive_->zip, fmt::format("{}.npy", key).c_str(), 0);
  if (index < 0) {
    throw Error(where, "is missing", fmt::format("The file has: {}", fmt::join(Keys(), ", ")));
  }
  const auto damaged = [&](std::string_view detail) {
    return Error(where, fmt::format("is damaged or cut off ({})", detail),
                 "Copy or save the file again");
  };
  zip_stat_t stat;
  if (zip_stat_index(archive_->zip, static_cast<zip_uint64_t>(index), 0, &stat) != 0 ||
      (stat.valid & ZIP_STAT_SIZE) == 0 || (stat.valid & ZIP_STAT_COMP_SIZE) == 0) {
    throw damaged("no size");
  }
  if (stat.size > kMaxMemberBytes || stat.size / kMaxDeflateRatio > stat.comp_size + 1) {
    throw damaged(fmt::format("{} bytes packed claim to be {}", stat.comp_size, stat.size));
  }
  const std::unique_ptr<zip_file_t, ZipCloser> file(
      zip_fopen_index(archive_->zip, static_cast<zip_uint64_t>(index), 0));
  if (!file) throw damaged(zip_strerror(archive_->zip));

  const auto read_exactly = [&](void* target, std::size_t bytes) {
    auto* to = static_cast<char*>(target);
    while (bytes > 0) {
      const auto got = zip_fread(file.get(), to, bytes);
      if (got <= 0) throw damaged(got < 0 ? zip_file_strerror(file.get()) : "ends too early");
      to += got;
      bytes -= static_cast<std::size_t>(got);
    }
  };
  unsigned char preamble[8];
  read_exactly(preamble, sizeof preamble);
  if (std::string_view(reinterpret_cast<char*>(preamble), 6) != kNpyMagic)
    throw damaged("not .npy data");
  const int length_bytes = preamble[6] == 1 ? 2 : 4;
  unsigned char length_field[4] = {};
  read_exactly(length_field, static_cast<std::size_t>(length_bytes));
  std::size_t header_bytes = 0;
  for (int i = length_bytes - 1; i >= 0; --i) header_bytes = header_bytes << 8 | length_field[i];
  if (header_bytes > kMaxHeaderBytes) throw damaged("an oversized header");
  std::string header(header_bytes, '\0');
  read_exactly(header.data(), header.size());

  NpyMember member{where, ParseNpyHeader(header, where)};
  const auto bytes = CheckedProduct(member.array.shape, member.array.item_size);
  const std::size_t preceding =
      sizeof preamble + static_cast<std::size_t>(length_bytes) + header_bytes;
  if (!bytes || *bytes + preceding != stat.size) {
    throw damaged(fmt::format("shape {} does not fit its {} bytes", member.ShapeText(), stat.size));
  }
  member.array.data.resize(*bytes);
  read_exactly(member.array.data.data(), *bytes);
  char beyond;  // reading past the end is what makes libzip compare the checksum
  if (zip_fread(file.get(), &beyond, 1) != 0) throw damaged("checksum");
  return member;
}

}  // namespace holdfast
