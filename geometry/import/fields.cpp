// SPDX-License-Identifier: MIT
#include "geometry/import/fields.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/io/container/text_scanner.h"

namespace holdfast {
namespace {

constexpr int kMaxPacked = 8;  // deeper packing is hostile

}  // namespace

DataValue Unpacked(DataValue value) {
  DataValue inner = value;
  for (int i = 0; i < kMaxPacked && inner.Kind() == DataKind::kList && inner.Size() == 1; ++i) {
    inner = inner[std::size_t{0}];
  }
  const DataKind kind = inner.Kind();
  const bool is_alone =
      kind == DataKind::kDict || kind == DataKind::kObject || kind == DataKind::kText;
  return is_alone ? inner : value;
}

Fields::Fields(const DataFile& file) : where_(file.Path().string()) {
  if (file.Format() == DataFormat::kNpz) {
    file_ = &file;
  } else {
    value_ = Unpacked(file.Root());
  }
}

Fields::Fields(DataValue value) : value_(Unpacked(std::move(value))), where_(value_->Where()) {}

bool Fields::Has(std::string_view name) const {
  return file_ != nullptr ? file_->Has(name) : value_->Has(name);
}

std::optional<std::string_view> Fields::FirstOf(std::span<const std::string_view> names) const {
  for (const std::string_view name : names) {
    if (Has(name)) return name;
  }
  return std::nullopt;
}

std::optional<DataValue> Fields::Find(std::string_view name) const {
  if (!Has(name)) return std::nullopt;
  return (*this)[name];
}

std::optional<DataValue> Fields::Find(std::span<const std::string_view> names) const {
  const std::optional<std::string_view> name = FirstOf(names);
  return name ? Find(*name) : std::nullopt;
}

DataValue Fields::operator[](std::string_view name) const {
  return Unpacked(file_ != nullptr ? (*file_)[name] : (*value_)[name]);
}

std::vector<std::string> Fields::Names() const {
  return file_ != nullptr ? file_->Names() : value_->Names();
}

void DropUnused(const Fields& fields, std::span<const std::string_view> used,
                ImportedClip& imported) {
  std::vector<std::string> unused;
  for (std::string& name : fields.Names()) {
    if (std::ranges::find(used, name) == used.end()) unused.push_back(std::move(name));
  }
  if (!unused.empty()) imported.dropped.push_back(fmt::format("{}", fmt::join(unused, ", ")));
}

std::string TextOf(const Fields& fields, std::string_view name) {
  const std::optional<DataValue> value = fields.Find(name);
  if (!value) return {};
  try {
    std::string text = value->Text();
    // Names are printed: none may garble a terminal.
    const bool garbles =
        std::ranges::any_of(text, [](unsigned char c) { return c < ' ' || c == 127; });
    return garbles ? std::string() : text;
  } catch (const Error&) {
    return {};  // descriptive texts only: never a reason to reject a motion
  }
}

std::optional<std::string> GenderOf(const DataValue& value) {
  std::string text;
  try {
    if (value.Kind() == DataKind::kInteger || value.Kind() == DataKind::kReal ||
        value.Kind() == DataKind::kArray) {
      const double number = value.Number();
      if (number == 1) return "male";
      if (number == 2) return "female";
    }
  } catch (const Error&) {
    // A numpy text scalar is an array, too.
  }
  try {
    text = value.Text();
  } catch (const Error&) {
    return std::nullopt;
  }
  // Old archives hold bytes in printed form: b'male'.
  if (text.size() > 3 && text.starts_with("b'")) text = text.substr(2, text.size() - 3);
  for (const std::string_view gender : {"male", "female", "neutral"}) {
    if (EqualIgnoringCase(text, gender)) return std::string(gender);
  }
  return std::nullopt;
}

}  // namespace holdfast
