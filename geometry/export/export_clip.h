// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/io/gltf/gltf_writer.h"
#include "geometry/io/gltf/mjcf_writer.h"
#include "geometry/mesh/mesh.h"
#include "geometry/options.h"
#include "geometry/parallel.h"

namespace holdfast {

enum class ExportFormat {
  kGlb,            ///< .glb: skin, skeleton, object, materials, animated
  kBvh,            ///< .bvh: the skeleton
  kUsda,           ///< .usda: skin, skeleton, object, animated
  kMjcf,           ///< .xml: hands and object for MuJoCo
  kClip,           ///< .npz: the clip
  kLines,          ///< .jsonl: poses and contacts, one line per frame
  kContacts,       ///< contacts.npz, x_contacts.npz: where hands touch the object
  kContactsTable,  ///< .csv: the same, plus a file with the poses of wrists and fingertips
  kMeshes,         ///< name_%04d.ply or .obj: one mesh per frame
};

/// Returns the extension in lower case: ".glb" for "held.GLB".
std::string ExtensionOf(const std::filesystem::path& path);
/// Returns the format of a file name. Throws Error, listing the formats, for an unsupported name.
ExportFormat ExportFormatOf(const std::filesystem::path& output);
/// Whether frames can be skipped (ExportOptions::every).
bool IsSampledByFrame(ExportFormat format);

struct ExportOptions {
  /// kGlb: put the motion on the skeleton of this character (.glb, .gltf), which keeps its skin.
  std::filesystem::path onto;
  bool correctives = true;    ///< kGlb, kUsda: pose correctives as morph targets
  double tolerance_m = 2e-5;  ///< maximum distance of the skin from the body model's
  /// kMjcf: of the object; empty: the mass of trials (PhysicsOfClip), 1000 without `physics`.
  std::optional<double> density_kg_m3;
  /// kMjcf: simulated parts (PhysicsOfClip of solver/trial); null: hands are only mocap bodies.
  const MjcfPhysics* physics = nullptr;
  int every = 1;        ///< IsSampledByFrame: every n-th frame
  int first_frame = 0;  ///< kMeshes: number of the clip's first frame
  /// kGlb: appearance of the object; null: plain.
  const TexturedMesh* object_look = nullptr;
  std::string name = "clip";  ///< of animation and model
  std::string generator = "Holdfast";
  int threads = 1;
};

/// Options of `export`.
OptionTable OptionsOf(ExportOptions& options);

/// Writes a clip as a USD text stage: z up, meters, time codes are the clip's frames. `/World/body`
/// is a SkelRoot: `skeleton` with its animation, and `skin`, whose blend shapes are the pose
/// correctives, as in WriteGlb. `/World/object` (with an object track and `object` not null) and
/// `/World/table` are meshes with a transform at the same frames.
SkinReport WriteUsda(const Clip& clip, const BodySurface& surface, const TriangleMesh* object,
                     const ExportOptions& options, const std::filesystem::path& path);

/// Writes a clip as lines of JSON, for viewers that are fed frame by frame (docs/formats.md): the
/// first line has names, parents and meshes, each other the poses and contacts of a frame.
void WriteSceneLines(const ClipScene& scene, const TriangleMesh* object,
                     const ExportOptions& options, const std::filesystem::path& path);

/// Summary of an export; members that do not apply to the format keep their defaults.
struct ExportReport {
  ExportFormat format = ExportFormat::kClip;
  std::vector<std::filesystem::path> files;  ///< or folders of files
  bool has_object = false;
  bool stopped = false;  ///< by the progress callback: meshes of some frames are missing
  SkinReport skin;       ///< of .glb and .usda
  MjcfReport mjcf;
  std::string skeleton;  ///< recognized skeleton of the character
  int joints = 0, joints_moved = 0;
  int contact_points = 0, contact_frames = 0, contact_hands = 0;
};

/// Returns the files that ExportClip writes, `output` first: also contacts_poses.csv for
/// contacts.csv, x_assets for x.xml, and for kMeshes two files per frame if there is an object.
std::vector<std::filesystem::path> ExportedFiles(const ClipScene& scene,
                                                 const ExportOptions& options,
                                                 const std::filesystem::path& output);

/// Writes `scene.clip` in the format of `output`, with `scene.object` along its track. Atomic
/// except for kMeshes. The progress stage is "export". Throws Error for an unsupported file name or
/// options, a character that is not glTF or has an unknown skeleton, a hand-only clip for a
/// character, contacts without an object, and files that cannot be read or written.
ExportReport ExportClip(const ClipScene& scene, const ExportOptions& options,
                        const std::filesystem::path& output, const StagedProgress& progress = {});

}  // namespace holdfast
