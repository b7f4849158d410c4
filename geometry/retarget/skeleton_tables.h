// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace holdfast {

/// Joint names of one family of programs.
struct SkeletonTable {
  std::string_view name;
  std::string_view left, right;
  /// SMPL-X joints and their source names. '*' is the side: "left"/"right" in the SMPL-X name, the
  /// table's own words in the source names; '#' is their first letter. '|' separates alternatives,
  /// of which the first present is used.
  std::vector<std::pair<std::string_view, std::string_view>> rows;
  std::vector<std::string> fingers;     ///< source names of the 15 joints of a hand; may be empty
  std::vector<std::string_view> marks;  ///< source joints unique to this table's skeletons
  std::optional<double> lumbar_lean = std::nullopt;  ///< see SkeletonMap
  /// Possible prefixes of all names, separated by '|'.
  std::string_view prefixes = {};
};

/// Names of the tables whose bones are those of VRM's extension.
inline constexpr std::string_view kHumanoidTables[] = {"VRM, Unity", "VRM, Unity with upper chest"};

/// Returns all tables. Names are compared by SkeletonKey.
const std::vector<SkeletonTable>& SkeletonTables();

/// Substitutes the side's word in a pattern of a row.
std::string SideName(std::string_view pattern, std::string_view side);

/// Normalizes a joint name for comparison: removes everything up to a last ':', '|' or '/', letter
/// case, spaces, '_', '-' and '.'.
std::string SkeletonKey(std::string_view name);

}  // namespace holdfast
