// SPDX-License-Identifier: MIT
#include "geometry/body/body_model_fields.h"

#include <variant>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/pickle/data_file.h"
#include "geometry/value_ranges.h"

namespace holdfast {
namespace {

bool IsZip(const std::filesystem::path& path) { return ByteSource(path).Head(2) == "PK"; }

}  // namespace

struct BodyModelFields::Source {
  std::variant<NpzReader, DataFile> file;
};

BodyModelFields::BodyModelFields(const std::filesystem::path& path) : file_(path.string()) {
  // Torch archives are zips too; a .npz is one that has the arrays as members.
  if (IsZip(path)) {
    NpzReader archive(path);
    if (!archive.Keys().empty()) {
      source_ = std::make_unique<const Source>(Source{std::move(archive)});
      return;
    }
  }
  source_ = std::make_unique<const Source>(Source{DataFile(path)});
}

BodyModelFields::BodyModelFields(NpzReader archive)
    : file_(archive.Path().string()),
      source_(std::make_unique<const Source>(Source{std::move(archive)})) {}

BodyModelFields::~BodyModelFields() = default;
BodyModelFields::BodyModelFields(BodyModelFields&&) noexcept = default;

bool BodyModelFields::Has(std::string_view key) const {
  return std::visit([&](const auto& file) { return file.Has(key); }, source_->file);
}

NpyMember BodyModelFields::Read(std::string_view key) const {
  if (const auto* archive = std::get_if<NpzReader>(&source_->file)) return archive->Read(key);
  return std::get<DataFile>(source_->file)[key].Array();
}

std::vector<double> BodyModelFields::ReadFinite(std::string_view key,
                                                const std::vector<std::ptrdiff_t>& shape) const {
  const NpyMember member = Read(key);
  member.RequireShape(shape);
  std::vector<double> values = member.AsDoubles();
  if (const auto bad = FirstBeyond(std::span<const double>(values), kMostMetres)) {
    throw Error(member.where, fmt::format("holds {} at element {}", values[*bad], *bad),
                "The model file is damaged: get it again");
  }
  return values;
}

std::string_view BodyModelFields::FirstOf(std::initializer_list<std::string_view> keys) const {
  for (const std::string_view key : keys) {
    if (Has(key)) return key;
  }
  return {};
}

}  // namespace holdfast
