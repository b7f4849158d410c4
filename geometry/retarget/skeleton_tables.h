// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast {

/// One row of a table: SMPL-X joint and what sources call it. '*' stands for the side:
/// "left"/"right" on SMPL-X's part, the table's own words on the source's, '#' for their first
/// letters. '|' parts names of which the first that is there counts.
struct SkeletonRow {
  std::string_view target;
  std::string_view sources;
};

/// What one family of programs calls the joints of a body.
struct SkeletonTable {
  std::string_view name;
  std::string_view left, right;
  std::vector<SkeletonRow> rows;
  std::vector<std::string_view> marks;  ///< source joints that no other table's skeletons have
  std::optional<double> lumbar_lean = std::nullopt;  ///< see SkeletonMap
  /// What may stand before every name, '|' between.
  std::string_view prefixes = {};
};

/// Names of the tables whose bones are those of VRM's extension.
inline constexpr std::string_view kHumanoidTables[] = {"VRM, Unity", "VRM, Unity with upper chest"};

/// All tables. Names are compared by SkeletonKey.
const std::vector<SkeletonTable>& SkeletonTables();

/// A pattern of a row with the side's word in it.
std::string SideName(std::string_view pattern, std::string_view side);

/// A joint's name without what differs from program to program: everything up to a last ':', '|' or
/// '/', letter case, spaces, '_', '-' and '.'.
std::string SkeletonKey(std::string_view name);

}  // namespace holdfast
