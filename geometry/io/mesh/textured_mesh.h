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

/// How a surface looks, in glTF's terms.
struct Material {
  std::string name;
  Eigen::Vector4d color{0.8, 0.8, 0.8, 1.0};  ///< linear red, green, blue, and opacity
  double metallic = 0.0;
  double roughness = 0.5;
  std::string image;  ///< a PNG or JPEG file's bytes, of the color; empty: none
};

/// A mesh for display: parts of one material each, vertices parted where normals or texture
/// coordinates are.
struct TexturedMesh {
  struct Part {
    TriangleMesh mesh;         ///< meters
    Eigen::Matrix3Xd normals;  ///< (3 x V), unit
    Eigen::Matrix2Xd uv;       ///< (2 x V), v upwards; empty: none
    int material = 0;
  };
  std::vector<Material> materials;
  std::vector<Part> parts;
  std::vector<std::string> notes;  ///< what of the file was left out, and why
};

/// Whether a file begins as those do.
bool IsPngOrJpeg(std::string_view bytes);

/// The images of one mesh's materials. Materials may share a file and each takes it whole, so a
/// small file could ask for any amount of memory: together they get 256 MB.
class MaterialImages {
 public:
  /// Whether more may be added.
  bool HasRoom() const { return room_ > 0; }
  /// Gives the image to the material; says why in `notes` when it does not, and returns false.
  /// `name` is what the notes call the image.
  bool Add(std::string bytes, std::string_view name, Material& material,
           std::vector<std::string>& notes);

 private:
  std::size_t room_ = std::size_t{256} << 20;
};

/// Of objects that bring none.
inline Material ObjectMaterial() { return {"object", {0.16, 0.38, 0.62, 1}, 0, 0.45, {}}; }

/// The mesh after x -> A x, its normals with it, faces outside out as before.
void Transform(const Eigen::Matrix3d& A, TexturedMesh& mesh);

/// A mesh in one material, creases kept sharp.
TexturedMesh PlainMesh(const TriangleMesh& mesh, Material material);

/// Texture coordinates and materials of an .obj file, coordinates multiplied by `scale`; nothing
/// for one that has neither. Of its .mtl files: Kd, d, Tr, Ns, Pr, Pm and map_Kd (PNG and JPEG);
/// they and the images are looked for beside the mesh and below it, nowhere else. Throws Error for
/// a file that ReadMeshFile refuses.
std::optional<TexturedMesh> ReadTexturedObj(const std::filesystem::path& path, double scale = 1.0);

}  // namespace holdfast
