// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/io/container/data_value.h"

namespace holdfast {

enum class DataFormat { kNpz, kNpy, kPickle, kTorchZip, kTorchLegacy, kJson, kSafetensors };

std::string_view DataFormatName(DataFormat format);

/// A file of named values in any of the formats in which the field keeps them, format detected from
/// the content: numpy's .npz and .npy, pickle, torch (zip and the form before it, whatever the name
/// ends in), JSON, safetensors; also packed by gzip. Nothing in the file is ever executed: classes
/// other than the few that plain data are made of are refused by name (see pickle.h).
class DataFile {
 public:
  /// Throws Error for a file that is missing, empty, cut off, malformed, or of another format.
  explicit DataFile(const std::filesystem::path& path);
  /// The same for a file in memory, which must outlive this; `name` goes into messages.
  DataFile(std::span<const std::byte> bytes, std::string name);
  ~DataFile();
  DataFile(DataFile&&) noexcept;
  DataFile& operator=(DataFile&&) noexcept;

  DataFormat Format() const;
  const std::filesystem::path& Path() const;

  /// Top-level names. A .npz reads its members on demand: has() and names cost nothing.
  bool Has(std::string_view name) const;
  std::vector<std::string> Names() const;
  /// Throws Error when there is none of that name (listing what is there), or it is malformed.
  DataValue operator[](std::string_view name) const;
  std::optional<DataValue> Find(std::string_view name) const;
  /// The whole file as one value: what a pickle holds that is no dict. Of .npz and safetensors, a
  /// dict of all members, which are read for it.
  DataValue Root() const;
  /// Texts beside the values: the metadata of safetensors, else nothing.
  std::map<std::string, std::string> Metadata() const;

 private:
  struct Content;
  std::unique_ptr<Content> content_;
};

/// Whether a text is JSON lines: a JSON value a line, more than one.
bool IsJsonLines(std::string_view text);

/// A JSON text as plain data, JSON lines as a list of their values; `where` names the file in
/// errors. Throws Error for what is not JSON (with the place), for more than 100 levels, and for
/// values that would take more memory than `memory_limit` bytes.
DataValue ReadJsonData(std::string_view text, const std::string& where, std::size_t memory_limit);

}  // namespace holdfast
