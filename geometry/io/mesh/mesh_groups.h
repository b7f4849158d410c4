// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// A named part of a mesh as its file has it.
struct MeshGroup {
  enum class Kind { kGroup, kObject, kMaterial };
  Kind kind = Kind::kGroup;
  std::string name;
  TriangleMesh surface;  ///< its triangles alone, in the file's unit
};

/// Groups (`g`), objects (`o`) and materials (`usemtl`) of an .obj file that have faces, in the
/// order in which they are first named; a face is in each of its groups. None in other formats.
/// Throws Error for a file that ReadMeshFile refuses.
std::vector<MeshGroup> ReadMeshGroups(const std::filesystem::path& path);

/// The faces of a mesh that a list of its vertices covers: those with two corners or more in the
/// list. `path` is a text of vertex ids as ReadMeshFile counts them, from 0, between blanks, commas
/// or lines; what follows a # is passed over. Throws Error for anything else, ids out of range, and
/// a list that covers no face.
TriangleMesh ReadVertexRegion(const std::filesystem::path& path, const TriangleMesh& mesh);

}  // namespace holdfast
