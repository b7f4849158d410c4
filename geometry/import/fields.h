// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/io/pickle/data_file.h"

namespace holdfast {

/// The value itself, where it was packed alone into a list or a numpy array of Python objects:
/// np.savez of a dict gives a 0-d array that holds it.
DataValue Unpacked(DataValue value);

/// Named values, of a whole file or of a dict in one: importers ask both the same way.
class Fields {
 public:
  /// `file` must outlive this.
  explicit Fields(const DataFile& file);
  explicit Fields(DataValue value);

  bool Has(std::string_view name) const;
  /// The first of `names` that is there.
  std::optional<std::string_view> FirstOf(std::span<const std::string_view> names) const;
  std::optional<DataValue> Find(std::string_view name) const;
  std::optional<DataValue> Find(std::span<const std::string_view> names) const;
  /// Throws Error when it is not there, listing what is.
  DataValue operator[](std::string_view name) const;
  /// The dict of that name.
  Fields In(std::string_view name) const { return Fields((*this)[name]); }
  std::vector<std::string> Names() const;
  const std::string& Where() const { return where_; }

 private:
  const DataFile* file_ = nullptr;  // of an .npz, whose members are read on demand
  std::optional<DataValue> value_;
  std::string where_;
};

/// The names in `fields` that are none of `used`, one text, empty without any: for what an importer
/// leaves out.
std::string UnusedNames(const Fields& fields, std::span<const std::string_view> used);

/// A text, empty when it is not there or no text.
std::string TextOf(const Fields& fields, std::string_view name);

/// "male", "female" or "neutral" of a text in any of the field's spellings or of IMoS's numbers (1
/// male, 2 female); nothing for all else.
std::optional<std::string> GenderOf(const DataValue& value);

}  // namespace holdfast
