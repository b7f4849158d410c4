// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace holdfast {

/// What is said of files that end too early.
inline constexpr const char* kTruncated = "The file may be cut short: copy or export it again";

/// What a mesh file holds. Files are read here and not by OpenMesh, which only writes them:
/// OpenMesh 9 skips lines that it cannot parse (which shifts all later ids), opens whatever an .obj
/// file names as its material, reads on past the end of truncated files, repeats the last number
/// where one is missing, allocates what headers promise, checks no id, holds positions in single
/// precision, and its half-edge mesh refuses what is not manifold.
struct MeshScan {
  std::vector<Eigen::Vector3d> positions;
  std::vector<int> polygon_begin = {
      0};                        ///< polygon i: ids polygon_begin[i] .. polygon_begin[i + 1]
  std::vector<int> polygon_ids;  ///< in range
  std::size_t num_left_out = 0;  ///< .obj, .stl: polygons of fewer than three different corners
  std::size_t num_unread = 0;    ///< .stl: bytes behind the triangles
};

/// A text whose lines all end with a line feed, without byte order mark: a carriage return ends a
/// line too. With `continued`, a backslash at the end of a line that is no comment goes on with the
/// next, in its place, and as many empty lines follow: numbers of lines stay.
std::string PlainLines(std::string_view bytes, bool continued);

/// Each throws Error (`name`, with the line where there are lines) unless `bytes` can be read
/// completely. Memory stays in proportion to the bytes given.
MeshScan ScanObj(std::string_view bytes, const std::string& name);
MeshScan ScanOff(std::string_view bytes, const std::string& name);
MeshScan ScanStl(std::string_view bytes, const std::string& name);
MeshScan ScanPly(std::string_view bytes, const std::string& name);

}  // namespace holdfast
