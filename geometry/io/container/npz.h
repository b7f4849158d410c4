// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace holdfast {

class ZipArchive;

/// Maximum number of dimensions of an array: NumPy's limit.
inline constexpr std::size_t kMaxRank = 32;

/// One array of a NumPy `.npz` archive, as stored: element type, shape and raw bytes. Reading only
/// converts and executes nothing (NpzReader rejects object arrays by name, DataFile takes the plain
/// data in them).
struct NpyArray {
  char kind = 'f';  ///< 'f' float, 'i' signed, 'u' unsigned, 'b' bool, 'U' UCS-4 text, 'S' bytes
  std::size_t item_size = 4;  ///< bytes per element
  bool big_endian = false;
  bool fortran_order = false;
  std::vector<std::size_t> shape;
  std::vector<std::byte> data;

  std::size_t NumElements() const;
};

/// A member of an archive with its name for messages ("clip.npz[trans]").
struct NpyMember {
  std::string where;
  NpyArray array;

  /// The stored values without copying; nullopt unless they are stored as C-ordered, little-endian
  /// T. T: float, double, signed and unsigned integers.
  template <typename T>
  std::optional<std::span<const T>> View() const;
  /// Values in C order as doubles. Throws Error for text, object and complex arrays.
  std::vector<double> AsDoubles() const;
  /// Values in C order as floats, without a double copy in between.
  std::vector<float> AsFloats() const;
  /// Values in C order as signed integers. Throws Error if the array holds fractions.
  std::vector<std::int64_t> AsIntegers() const;
  /// A scalar text (unicode or bytes, 0-d or one element), trailing NULs dropped.
  std::string AsText() const;
  /// Throws Error unless the shape is `expected`; -1 matches any length.
  void RequireShape(const std::vector<std::ptrdiff_t>& expected) const;
  std::string ShapeText() const;
};

/// Read access to a `.npz` archive (zip, stored or deflated, zip64). Members are read on demand,
/// directly into the returned array: a 2 GB member takes 2 GB, and a deflated one up to 256 MB more
/// for its packed bytes during unpacking.
class NpzReader {
 public:
  /// Throws Error if the file is missing, empty, or not a zip archive.
  explicit NpzReader(const std::filesystem::path& path);
  /// Same for an archive in memory, which must outlive the reader; `name` is used in messages.
  NpzReader(std::span<const std::byte> bytes, std::string name);
  /// Same for an archive that is already open.
  explicit NpzReader(std::unique_ptr<const ZipArchive> archive);
  ~NpzReader();
  NpzReader(NpzReader&&) noexcept;
  NpzReader& operator=(NpzReader&&) noexcept;

  bool Has(std::string_view key) const;
  /// Names of the members, in the archive's order, without NumPy's suffix `.npy`.
  std::vector<std::string> Keys() const;
  /// Element type (kind 'O' for Python objects) and shape, without the data.
  NpyMember ReadHeader(std::string_view key) const;
  /// Throws Error if the member is missing (listing those that exist), twice in the archive,
  /// encrypted, packed with an unknown method, truncated, or malformed.
  NpyMember Read(std::string_view key) const;
  /// For an array of Python objects (kind 'O'): the pickle that holds its data. Read it with
  /// ReadObjectArray, which executes nothing.
  std::vector<std::byte> ReadPickle(std::string_view key, std::size_t limit_bytes) const;
  const std::filesystem::path& Path() const { return path_; }

 private:
  std::filesystem::path path_;
  std::unique_ptr<const ZipArchive> archive_;
};

/// Collects arrays and writes them as one deflated `.npz`, to a temporary file that is renamed to
/// `path`: after a crash or a full disk the old file is unchanged. The same arrays give the same
/// bytes (members sorted by name, fixed time stamps).
class NpzWriter {
 public:
  void AddFloat32(std::string key, std::vector<std::size_t> shape, std::vector<float> values);
  void AddFloat64(std::string key, std::vector<std::size_t> shape, std::vector<double> values);
  /// Half precision: rounds to nearest even. Throws Error if a value overflows (|x| > 65504).
  void AddFloat16(std::string key, std::vector<std::size_t> shape,
                  const std::vector<float>& values);
  void AddInt64(std::string key, std::vector<std::size_t> shape, std::vector<std::int64_t> values);
  void AddUint8(std::string key, std::vector<std::size_t> shape, std::vector<std::uint8_t> values);
  /// A 0-d unicode scalar, as `np.savez(key="text")` writes it.
  void AddText(std::string key, std::string_view text);
  /// A 1-d unicode array, as `np.savez(key=["a", "bc"])` writes it.
  void AddTexts(std::string key, const std::vector<std::string>& texts);
  /// Adds an array as it was read elsewhere, unchanged.
  void Add(std::string key, NpyArray array);

  void Write(const std::filesystem::path& path) const;

 private:
  std::map<std::string, NpyArray> arrays_;
};

}  // namespace holdfast
