// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Appearance of a surface, in glTF's terms.
struct Material {
  std::string name;
  Eigen::Vector4d color{0.8, 0.8, 0.8, 1.0};  ///< linear red, green, blue, and opacity
  double metallic = 0.0;
  double roughness = 0.5;
  std::string image;  ///< bytes of a PNG or JPEG file with the color; empty: none
};

/// A mesh for display: parts of one material each, with separate vertices where normals or texture
/// coordinates differ.
struct TexturedMesh {
  struct Part {
    TriangleMesh mesh;         ///< meters
    Eigen::Matrix3Xd normals;  ///< (3 x V), unit
    Eigen::Matrix2Xd uv;       ///< (2 x V), v upwards; empty: none
    int material = 0;
  };
  std::vector<Material> materials;
  std::vector<Part> parts;
  std::vector<std::string> notes;  ///< what was left out of the file, and why
};

/// Bytes for the images of one mesh's materials together. Materials may share a file, of which each
/// takes a copy, so a small file could demand any amount of memory.
inline constexpr std::size_t kMaterialImagesRoom = std::size_t{256} << 20;

/// Gives the image to the material and takes its bytes from `room`; if it cannot, returns false and
/// adds the reason to `notes`. `name` is the name of the image in the notes.
bool AddImage(std::string bytes, std::string_view name, std::size_t& room, Material& material,
              std::vector<std::string>& notes);

/// Material of objects that have none.
inline Material ObjectMaterial() { return {"object", {0.16, 0.38, 0.62, 1}, 0, 0.45, {}}; }

/// Transforms a mesh by x -> A x, with its normals; faces stay oriented outward.
void Transform(const Eigen::Matrix3d& A, TexturedMesh& mesh);

/// Makes a mesh of one material; creases stay sharp.
TexturedMesh PlainMesh(const TriangleMesh& mesh, Material material);

/// Reads texture coordinates and materials of an .obj file, with positions multiplied by `scale`;
/// nullopt for a file with neither. From its .mtl files: Kd, d, Tr, Ns, Pr, Pm and map_Kd (PNG and
/// JPEG); these files and the images are searched in the mesh's folder and below it, nowhere else.
/// Throws Error for a file that ReadMeshFile rejects.
std::optional<TexturedMesh> ReadTexturedObj(const std::filesystem::path& path, double scale = 1.0);

/// A named part of a mesh, as defined by its file.
struct MeshGroup {
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
