// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/npz.h"

namespace holdfast {

/// Texts stored with the tensors: the format's `__metadata__`.
using SafetensorsMetadata = std::map<std::string, std::string>;

/// One tensor of a safetensors file, as described by its header.
struct SafetensorsEntry {
  std::string name;
  std::string dtype;  ///< the format's word: "F32", "BF16", "I64", ...
  std::vector<std::size_t> shape;
  std::uint64_t begin = 0;  ///< offset of its bytes from the end of the header
  std::uint64_t end = 0;
};

/// Reads safetensors files: 8 bytes with the length of a JSON header, the header, the tensors.
/// Opening reads and checks only the header; tensors are read on demand, without a copy.
class SafetensorsReader {
 public:
  static constexpr std::size_t kMaxHeaderBytes = 100'000'000;  ///< limit set by the format

  /// Throws Error for a file that is missing or truncated, and for a header that is malformed,
  /// names a tensor twice, or whose tensors overlap, leave gaps, or do not fit their shapes.
  explicit SafetensorsReader(const std::filesystem::path& path);
  explicit SafetensorsReader(ByteSource source);

  const SafetensorsMetadata& Metadata() const { return metadata_; }
  const ByteSource& Source() const { return source_; }
  bool Has(std::string_view name) const { return Find(name) != nullptr; }
  /// Sorted.
  std::vector<std::string> Names() const;
  /// Returns a tensor as stored, except that bfloat16, in which none of our CPUs computes, becomes
  /// float32 (exact). Throws Error if the name does not exist (listing those that do) or its type
  /// is not supported (8-bit floats).
  NpyMember Read(std::string_view name) const;

  /// Whether a file of `file_bytes` that begins with `head` (16 bytes or more) may have this
  /// format.
  static bool Recognizes(std::string_view head, std::uint64_t file_bytes);

 private:
  const SafetensorsEntry* Find(std::string_view name) const;
  void CheckLayout();

  ByteSource source_;
  std::uint64_t data_offset_ = 0;
  std::vector<SafetensorsEntry> entries_;  // sorted by name
  SafetensorsMetadata metadata_;
};

/// Collects tensors and writes them as one safetensors file, to a temporary file that is renamed to
/// `path`. The same tensors give the same bytes in any order of insertion: widest elements first,
/// then by name, so that every tensor is aligned to its elements.
class SafetensorsWriter {
 public:
  void AddFloat32(std::string name, std::vector<std::size_t> shape, std::span<const float> values);
  void AddFloat64(std::string name, std::vector<std::size_t> shape, std::span<const double> values);
  /// Rounds to nearest even. Throws Error if a finite value overflows.
  void AddFloat16(std::string name, std::vector<std::size_t> shape, std::span<const float> values);
  void AddInt64(std::string name, std::vector<std::size_t> shape,
                std::span<const std::int64_t> values);
  /// Numbers of any other type, C-ordered and little-endian. Throws Error for text.
  void Add(std::string name, NpyArray array);
  void SetMetadata(SafetensorsMetadata metadata) { metadata_ = std::move(metadata); }

  void Write(const std::filesystem::path& path) const;

 private:
  std::map<std::string, NpyArray> tensors_;
  SafetensorsMetadata metadata_;
};

}  // namespace holdfast
