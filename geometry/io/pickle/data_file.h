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

/// A file of named values in any of the field's formats, detected from the content: numpy's .npz
/// and .npy, pickle, torch (zip and the earlier form, whatever the extension), JSON, safetensors;
/// also gzipped. Nothing in the file is ever executed: classes other than the few that make up
/// plain data are rejected by name (see pickle.h).
class DataFile {
 public:
  /// Throws Error for a file that is missing, empty, truncated, malformed, or of another format.
  explicit DataFile(const std::filesystem::path& path);
  /// Same for a file in memory, which must outlive this; `name` is used in messages.
  DataFile(std::span<const std::byte> bytes, std::string name);
  ~DataFile();
  DataFile(DataFile&&) noexcept;
  DataFile& operator=(DataFile&&) noexcept;

  DataFormat Format() const;
  const std::filesystem::path& Path() const;

  /// Top-level names. Members of an .npz are read on demand: Has() and Names() cost nothing.
  bool Has(std::string_view name) const;
  std::vector<std::string> Names() const;
  /// Throws Error if the name does not exist (listing those that do), or the value is malformed.
  DataValue operator[](std::string_view name) const;
  std::optional<DataValue> Find(std::string_view name) const;
  /// The whole file as one value, for example a pickle that is not a dict. For .npz and
  /// safetensors, a dict of all members, which are read for it.
  DataValue Root() const;
  /// Texts stored with the values: the metadata of safetensors, else nothing.
  std::map<std::string, std::string> Metadata() const;

 private:
  struct Content;
  std::unique_ptr<Content> content_;
};

/// Whether a text is JSON lines: one JSON value per line, and more than one line.
bool IsJsonLines(std::string_view text);

/// Parses a JSON text as plain data, JSON lines as a list of their values; `where` names the file
/// in errors. Throws Error for text that is not JSON (with the position), for more than 100 levels,
/// and for values that would take more memory than `memory_limit` bytes.
DataValue ReadJsonData(std::string_view text, const std::string& where, std::size_t memory_limit);

}  // namespace holdfast
