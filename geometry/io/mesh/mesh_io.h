// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// A mesh as a file holds it: nothing welded, dropped or reordered, so that what is wrong with it
/// can still be seen (geometry/mesh/mesh_check.h).
struct MeshFile {
  TriangleMesh mesh;               ///< polygons split into triangles, those of 64 corners as fans
  std::vector<std::string> notes;  ///< what was done on the way, as plain sentences
};

/// Reads a surface mesh by its extension, in capitals or not: `.obj`, `.ply` (text and binary),
/// `.stl` (text and binary), `.off` (text), `.glb` and `.gltf` (ReadGltfScene). Numbers are taken
/// as meters; texture, normals, colors and materials are passed over. Faces are kept when doubled,
/// without area or non-manifold; in .obj and .stl files each corner of a face is taken once, and
/// faces of fewer than three are left out (noted). An .stl file holds loose triangles: corners at
/// the same place become one vertex.
///
/// Positions are in double precision where the file has it.
///
/// Throws Error naming the file, the line where there are lines, and the fault: missing, a folder,
/// empty, unknown extension, truncated, not of its format, NaN or infinite coordinates, vertex ids
/// out of range, no vertices, no faces. A header that promises more than the file can hold is
/// refused before anything is allocated for it. Safe to call from several threads.
MeshFile ReadMeshFile(const std::filesystem::path& path);

/// The same for a file's content; `path` tells the format and goes into messages.
MeshFile ReadMeshBytes(std::string_view bytes, const std::filesystem::path& path);

/// Whether the name ends as one of those formats does.
bool HasMeshFormat(const std::filesystem::path& path);

/// The mesh of ReadMeshFile.
TriangleMesh ReadMesh(const std::filesystem::path& path);

/// Writes a mesh through OpenMesh, by extension, atomically: `.obj` and `.off` as text, `.ply` and
/// `.stl` as binary. Positions are stored in single precision (half a nanometer for an object of
/// centimeters size, picometers in .obj). The same mesh gives the same bytes. Throws Error for an
/// unknown extension, a mesh without faces, ids out of range, coordinates that are not finite in
/// single precision, and when the file cannot be written.
void WriteMesh(const TriangleMesh& mesh, const std::filesystem::path& path);

}  // namespace holdfast
