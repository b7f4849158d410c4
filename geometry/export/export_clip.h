// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "geometry/clip/clip_body.h"
#include "geometry/io/gltf/gltf_writer.h"
#include "geometry/io/gltf/mjcf_writer.h"
#include "geometry/parallel.h"

namespace holdfast {

enum class ExportFormat {
  kGlb,            ///< .glb: skin, skeleton, object, materials, animated
  kBvh,            ///< .bvh: the skeleton
  kUsda,           ///< .usda: points and transforms
  kMjcf,           ///< .xml: hands and object for MuJoCo
  kClip,           ///< .npz: the clip
  kContacts,       ///< contacts.npz, x_contacts.npz: where hands touch the object
  kContactsTable,  ///< .csv: the same, with the poses of wrists and fingertips beside it
  kMeshes,         ///< name_%04d.ply or .obj: a mesh a frame
};

/// ".glb" of "held.GLB": in lower case.
std::string ExtensionOf(const std::filesystem::path& path);
/// By the file's name. Throws Error for one that no format has, and says which there are.
ExportFormat ExportFormatOf(const std::filesystem::path& output);
/// Whether frames may be left out in between (ExportOptions::every).
bool IsSampledByFrame(ExportFormat format);
struct ExportOptions {
  /// kGlb: the motion on the skeleton of this character (.glb, .gltf), which keeps its skin.
  std::filesystem::path onto;
  bool correctives = true;        ///< kGlb: pose correctives as morph targets
  double tolerance_m = 2e-5;      ///< of the skin from the body model's
  double density_kg_m3 = 1000.0;  ///< kMjcf: of the object, without `physics`
  /// kMjcf: what is simulated (PhysicsOfClip of solver/trial); null: hands are mocap bodies alone.
  const MjcfPhysics* physics = nullptr;
  int every = 1;        ///< kMeshes, kUsda, kMjcf: each n-th frame
  int first_frame = 0;  ///< kMeshes: number of the clip's first frame
  /// kGlb: how the object looks; null: plain.
  const TexturedMesh* object_look = nullptr;
  const TriangleMesh* table = nullptr;  ///< that the object rests on, of a clip with its track
  std::string name = "clip";            ///< of animation and model
  std::string generator = "Holdfast";
  int threads = 1;
};

/// What was written; parts that the format does not have are as they begin.
struct ExportReport {
  ExportFormat format = ExportFormat::kClip;
  std::vector<std::filesystem::path> files;  ///< or folders of files
  bool has_object = false;
  bool stopped = false;  ///< by the progress: meshes of some frames are missing
  GlbReport glb;
  MjcfReport mjcf;
  std::string skeleton;  ///< that the character has
  int joints = 0, joints_moved = 0;
  int contact_points = 0, contact_frames = 0, contact_hands = 0;
};

/// What ExportClip writes, the file `output` first: contacts.csv has contacts_poses.csv beside it,
/// x.xml the folder x_assets, and kMeshes two files a frame where there is an object.
std::vector<std::filesystem::path> ExportedFiles(const ClipScene& scene,
                                                 const ExportOptions& options,
                                                 const std::filesystem::path& output);

/// Writes `scene.clip` in the format of `output`, with `scene.object` along its track. Atomic but
/// for kMeshes. The progress's stage is "export". Throws Error for a name of no format, for
/// options that the format does not have, a character that is not glTF or has no known skeleton, a
/// hand alone for one, contacts without an object, and files that cannot be read or written.
ExportReport ExportClip(const ClipScene& scene, const ExportOptions& options,
                        const std::filesystem::path& output, const StagedProgress& progress = {});

}  // namespace holdfast
