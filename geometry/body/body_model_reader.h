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

/// The arrays of a body model's file by name, whatever holds them: `.npz` (read directly, member by
/// member), or a pickle as SMPL-X, SMPL-H and MANO are downloaded (see DataFile: nothing in it is
/// executed; sparse matrices and chumpy arrays come as plain arrays).
class BodyModelFields {
 public:
  /// Throws Error for a file that is missing or of no format that holds named arrays.
  explicit BodyModelFields(const std::filesystem::path& path);
  explicit BodyModelFields(NpzReader archive);
  ~BodyModelFields();
  BodyModelFields(BodyModelFields&&) noexcept;

  const std::string& File() const { return file_; }
  bool Has(std::string_view key) const;
  /// Throws Error for a missing field (listing what is there) and one that holds no numbers.
  NpyMember Read(std::string_view key) const;
  /// As doubles in C order. Throws Error unless of this shape (-1 matches any) and finite.
  std::vector<double> ReadFinite(std::string_view key,
                                 const std::vector<std::ptrdiff_t>& shape) const;
  /// The first of the names that is there; empty when none is.
  std::string_view FirstOf(std::initializer_list<std::string_view> keys) const;

 private:
  struct Source;
  std::string file_;
  std::unique_ptr<const Source> source_;
};

/// Reads and checks a body model's fields and brings them into SMPL-X's 55 joints; BodyModel::Load
/// says what they are and what is thrown. `name` goes into reports.
BodyModelParts ReadBodyModel(const BodyModelFields& fields, std::string name);

inline constexpr int kSmplxVertices = 10475;

/// The 778 vertices of SMPL-X that are MANO's, ascending (the published correspondence).
std::vector<int> SmplxHandVertices(Side side);

}  // namespace holdfast
