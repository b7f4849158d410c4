// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/body/skeleton.h"
#include "geometry/io/container/npz.h"

namespace holdfast {

/// The arrays of a body model file by name. Supports `.npz` (read member by member) and pickles as
/// SMPL-X, SMPL-H and MANO are distributed (see DataFile: nothing in the pickle is executed; sparse
/// matrices and chumpy arrays are converted to plain arrays).
class BodyModelFields {
 public:
  /// Throws Error for a missing file or a format without named arrays.
  explicit BodyModelFields(const std::filesystem::path& path);
  explicit BodyModelFields(NpzReader archive);
  ~BodyModelFields();
  BodyModelFields(BodyModelFields&&) noexcept;

  const std::string& File() const { return file_; }
  bool Has(std::string_view key) const;
  /// Throws Error for a missing field (listing the available ones) and a non-numeric field.
  NpyMember Read(std::string_view key) const;
  /// Returns doubles in C order. Throws Error unless of this shape (-1 matches any) and finite.
  std::vector<double> ReadFinite(std::string_view key,
                                 const std::vector<std::ptrdiff_t>& shape) const;
  /// Returns the first of the names that is present; empty if none is.
  std::string_view FirstOf(std::initializer_list<std::string_view> keys) const;

 private:
  struct Source;
  std::string file_;
  std::unique_ptr<const Source> source_;
};

/// Reads and checks the fields of a body model and converts them to SMPL-X's 55 joints. For the
/// fields and errors see BodyModel::Load. `name` is used in reports.
BodyModelParts ReadBodyModel(const BodyModelFields& fields, std::string name);

inline constexpr int kSmplxVertices = 10475;

/// The 778 vertices of SMPL-X that are MANO's, ascending (the published correspondence).
std::vector<int> SmplxHandVertices(Side side);

}  // namespace holdfast
