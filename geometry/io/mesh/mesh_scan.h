// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace holdfast {

/// Remedy for files that end too early.
inline constexpr const char* kTruncated = "The file may be cut short: copy or export it again";

/// Content of a mesh file. Files are read here and only written by OpenMesh: OpenMesh 9 skips lines
/// that it cannot parse (which shifts all later ids), opens any file that an .obj names as its
/// material, reads past the end of truncated files, repeats the last number if one is missing,
/// allocates what headers state, checks no id and stores positions in single precision; its
/// half-edge mesh rejects surfaces that are not manifold.
struct MeshScan {
  std::vector<Eigen::Vector3d> positions;
  std::vector<int> polygon_begin = {
      0};                        ///< polygon i: ids polygon_begin[i] .. polygon_begin[i + 1]
  std::vector<int> polygon_ids;  ///< in range
  std::size_t num_left_out = 0;  ///< .obj, .stl: polygons of fewer than three different corners
  std::size_t num_unread = 0;    ///< .stl: bytes after the triangles
};

/// Returns a text whose lines all end with a line feed, without byte order mark; a carriage return
/// ends a line, too. With `continued`, a backslash at the end of a line that is not a comment joins
/// the next line to it, and as many empty lines follow: line numbers are kept.
std::string PlainLines(std::string_view bytes, bool continued);

/// Each function throws Error (`name`, with the line if there are lines) unless `bytes` can be read
/// completely. Memory is proportional to the number of bytes.
MeshScan ScanObj(std::string_view bytes, const std::string& name);
MeshScan ScanOff(std::string_view bytes, const std::string& name);
MeshScan ScanStl(std::string_view bytes, const std::string& name);
MeshScan ScanPly(std::string_view bytes, const std::string& name);

}  // namespace holdfast
