// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// A mesh as stored in a file: nothing is welded, dropped or reordered, so that its faults can
/// still be detected (geometry/mesh/mesh_check.h).
struct MeshFile {
  TriangleMesh mesh;               ///< polygons split into triangles, as fans up to 64 corners
  std::vector<std::string> notes;  ///< what was done during reading, as plain sentences
};

/// Reads a surface mesh by its extension, ignoring case: `.obj`, `.ply` (text and binary), `.stl`
/// (text and binary), `.off` (text), `.glb` and `.gltf` (ReadGltfScene). Numbers are taken as
/// meters; texture, normals, colors and materials are ignored. Duplicate, zero-area and
/// non-manifold faces are kept. In .obj and .stl files, each corner of a face is taken once, and
/// faces of fewer than three are left out (noted). An .stl file holds separate triangles: corners
/// at the same position become one vertex.
///
/// Positions are in double precision if the file has it.
///
/// Throws Error naming the file, the line if there are lines, and the fault: missing, a folder,
/// empty, unknown extension, truncated, malformed, NaN or infinite coordinates, vertex ids out of
/// range, no vertices, no faces. A header that states more than the file can hold is rejected
/// before memory is allocated for it. Safe to call from several threads.
MeshFile ReadMeshFile(const std::filesystem::path& path);

/// Same for a file's content; `path` determines the format and is used in messages.
MeshFile ReadMeshBytes(std::string_view bytes, const std::filesystem::path& path);

/// Whether the file name has the extension of one of those formats.
bool HasMeshFormat(const std::filesystem::path& path);

/// Returns the mesh of ReadMeshFile.
TriangleMesh ReadMesh(const std::filesystem::path& path);

/// Writes a mesh through OpenMesh, by extension, atomically: `.obj` and `.off` as text, `.ply` and
/// `.stl` as binary. Positions are stored in single precision (half a nanometer for an object of
/// centimeters, picometers in .obj). The same mesh gives the same bytes. Throws Error for an
/// unknown extension, a mesh without faces, ids out of range, coordinates that are not finite in
/// single precision, and if the file cannot be written.
void WriteMesh(const TriangleMesh& mesh, const std::filesystem::path& path);

}  // namespace holdfast
