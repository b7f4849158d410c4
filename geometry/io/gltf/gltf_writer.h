// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include <tiny_gltf.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/io/mesh/textured_mesh.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

struct GlbOptions {
  std::string generator = "Holdfast";  ///< `asset.generator`
  std::string clip_name;               ///< name of the animation, also in `asset.extras`
  bool correctives = true;             ///< pose correctives as morph targets
  double corrective_tolerance_m = 2e-5;
  int threads = 1;
  /// Appearance of the object instead of a plain one; may be null. Images are written unchanged.
  const TexturedMesh* object_look = nullptr;
};

/// A skinned body as written to a file.
struct SkinReport {
  int morph_targets = 0;
  int influences = 4;             ///< joints per vertex: 4, or 8 if 4 are not enough
  double corrective_error_m = 0;  ///< largest distance from the body model's surface, meters
};

inline constexpr int kMaxCorrectiveShapes = 128;

/// The largest weights of each vertex, `sets` times four, in descending order and summing to one.
struct SkinWeights {
  int sets = 1;
  std::vector<std::array<std::uint8_t, 4>> joints;  ///< set by set, vertex by vertex
  Eigen::Matrix<float, 4, Eigen::Dynamic> weights;
};
SkinWeights LargestWeights(const BodySurface& surface);

/// Writes a clip as a glTF 2.0 binary: the skinned and animated body of `surface` and, if the clip
/// has an object track and `object` is not null, the object.
///
/// Nodes: `body` shows the skin and has the 55 joints below it by their SMPL-X names, posed as in
/// the first frame (Blender imports an armature with the mesh inside and no empties). Next to it
/// are the object and the table. z-up becomes glTF's y-up in the poses of these and of the pelvis.
/// The skin's inverse bind matrices are those of the T-pose; with the morph targets of a
/// CorrectiveBasis, the file's surface equals the body model's within `corrective_error_m`. Morph
/// weights are in [0, 1], to which Blender would clamp them. Single precision, no quantization; key
/// frames at the clip's frame rate, linear in between. Throws Error if the file would exceed the
/// format's 4 GB or cannot be written.
SkinReport WriteGlb(const Clip& clip, const BodySurface& surface, const TriangleMesh* object,
                    const GlbOptions& options, const std::filesystem::path& path);

}  // namespace holdfast

// Internal to the library: uses types of tinygltf.

namespace holdfast {

/// Maximum size of a .glb, whose lengths are 32 bits, minus room for its JSON.
inline constexpr std::size_t kMaxGltfBytes = std::numeric_limits<std::uint32_t>::max() - (1u << 24);

/// Quaternions x y z w over time, one per column.
using GltfQuaternions = Eigen::Matrix<float, 4, Eigen::Dynamic>;

/// Unit quaternions of rotations over time. Neighbors are in the same half of the sphere, so that
/// players rotate along the shorter arc.
GltfQuaternions ContinuousQuaternions(const std::vector<Eigen::Quaterniond>& rotations);

/// Same for R_after exp(axis_angle).
GltfQuaternions QuaternionsOverTime(const Eigen::Matrix3d& R_after,
                                    const Eigen::Matrix3Xd& axis_angle);

/// Rotation from (x, y, z) with z up to (x, z, -y).
Eigen::Matrix3d YUpFromZUp();

template <typename Vector>
std::vector<double> ToVector(const Vector& v) {
  return {v.begin(), v.end()};
}

/// Builds a glTF 2.0 scene with one animation, part by part. All returned indices are those of the
/// file's arrays.
class GltfBuilder {
 public:
  /// Sets `frames` key frames at `frame_rate` (Hz), linear in between.
  GltfBuilder(int frames, double frame_rate, const std::string& generator,
              const std::string& animation);

  /// Without a parent, the node is a root of the scene.
  int AddNode(tinygltf::Node node, int parent = -1);
  /// Poses a node in the z-up world as in the first frame and animates it.
  void Place(int node, const Eigen::Matrix3Xd& trans, const Eigen::Matrix3Xd& orient);
  /// Animates the rotation or translation of a node, and sets it as in the first frame.
  void Turn(int node, const GltfQuaternions& rotation);
  void Shift(int node, const Eigen::Matrix3Xf& translation);
  void Animate(int node, const char* path, int output);

  /// Adds a rigid mesh that moves along a track; it is named like the track, or else `usual`.
  void AddTracked(const TexturedMesh& rigid, const ObjectTrack& track, const char* usual);
  tinygltf::Primitive Primitive(const TriangleMesh& mesh, const Eigen::Matrix3Xd& normals,
                                int material);
  int AddMesh(tinygltf::Mesh mesh);
  int AddMaterial(const Material& look, bool double_sided);

  /// One element per column.
  int AddFloats(const Eigen::MatrixXf& columns, int type, int target = 0, bool with_range = false);
  int AddAccessor(const void* data, std::size_t num_bytes, std::size_t count, int component,
                  int type, int target);

  tinygltf::Model& Model() { return model_; }
  /// Returns a .glb. Throws Error if it would exceed the format's 4 GB.
  std::string Bytes() const;

 private:
  int AddTexture(const std::string& file);
  int AddView(const void* data, std::size_t num_bytes, int target);

  tinygltf::Model model_;
  std::map<std::string, int> texture_of_;  // by the image's bytes
  int times_ = -1;
};

}  // namespace holdfast
