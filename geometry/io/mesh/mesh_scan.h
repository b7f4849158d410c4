// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace holdfast {

/// What is said of files that end too early.
inline constexpr const char* kTruncated = "The file may be cut short: copy or export it again";

/// What a scan of a mesh file finds before OpenMesh may see it. OpenMesh 9 skips lines that it
/// cannot parse (which shifts all later ids), opens whatever an .obj file names as its material,
/// reads on past the end of truncated files, repeats the last number where one is missing,
/// allocates what headers promise, and checks no id.
struct MeshScan {
  std::vector<Eigen::Vector3d> positions;  ///< empty for .stl: loose corners
  std::vector<int> polygon_begin = {
      0};                         ///< polygon i: ids polygon_begin[i] .. polygon_begin[i + 1]
  std::vector<int> polygon_ids;   ///< in range
  std::size_t num_left_out = 0;   ///< .obj: polygons of fewer than three different corners
  std::size_t num_triangles = 0;  ///< .stl: triangles in the file
  std::string_view format;        ///< in which OpenMesh is to read: binary "ply" or "stl"
  /// What OpenMesh is to read in place of the file: its positions and polygons and nothing else.
  /// Empty when the file itself is as plain as that.
  std::string plain;
};

/// Sets `plain` to the positions and polygons as a binary .ply file. Of all that OpenMesh reads it
/// is the form with nothing to misunderstand, and a polygon takes time in proportion to its corners
/// (in an .obj file to their square).
void WritePlainPly(MeshScan& scan);

/// Each throws Error (`name`, with the line where there are lines) unless OpenMesh can read
/// `bytes`, or the plain form, safely and completely. Memory stays in proportion to the bytes
/// given.
MeshScan ScanObj(std::string_view bytes, const std::string& name);
MeshScan ScanOff(std::string_view bytes, const std::string& name);
MeshScan ScanStl(std::string_view bytes, const std::string& name);
MeshScan ScanPly(std::string_view bytes, const std::string& name);

}  // namespace holdfast
