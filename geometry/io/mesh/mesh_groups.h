// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// A named part of a mesh, as defined by its file.
struct MeshGroup {
  enum class Kind { kGroup, kObject, kMaterial };
  Kind kind = Kind::kGroup;
  std::string name;
  TriangleMesh surface;  ///< only its triangles, in the file's unit
};

/// Returns the groups (`g`), objects (`o`) and materials (`usemtl`) of an .obj file that have
/// faces, in the order in which they are first named; a face is in each of its groups. Empty for
/// other formats. Throws Error for a file that ReadMeshFile rejects.
std::vector<MeshGroup> ReadMeshGroups(const std::filesystem::path& path);

/// Returns the faces of a mesh that a list of its vertices covers: those with at least two corners
/// in the list. `path` is a text of vertex ids as ReadMeshFile counts them, from 0, separated by
/// blanks, commas or lines; text after a # is ignored. Throws Error for anything else, ids out of
/// range, and a list that covers no face.
TriangleMesh ReadVertexRegion(const std::filesystem::path& path, const TriangleMesh& mesh);

}  // namespace holdfast
