// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/body_layouts.h"
#include "geometry/clip/clip.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/io/mesh/textured_mesh.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Maximum of frames times joints that a reader accepts: about 2 GB in memory, an hour of a hundred
/// joints at 80 Hz.
inline constexpr double kMaxJointFrames = 3e7;

/// A motion as stored in a file, on the file's own skeleton: lengths in meters, everything else
/// (axes, rest pose, joint names) as found. Parents come before children; joint 0 is the root.
struct SourceMotion {
  struct EndSite {
    int parent;              ///< parent joint
    Eigen::Vector3d offset;  ///< in the parent's frame, meters
  };

  /// A rigid object that moves in the file next to the body.
  struct Prop {
    std::string name;
    TriangleMesh mesh;                          ///< in its own frame, meters; empty if not read
    std::optional<TexturedMesh> look;           ///< appearance of that mesh, if the file has one
    std::vector<Eigen::Quaterniond> rotations;  ///< per frame: x_world = q x + position
    Eigen::Matrix3Xd positions;                 ///< (3 x T) world, meters
  };

  std::string format;                    ///< "BVH", "ASF/AMC", "glTF", "SkillMimic" ...
  std::vector<std::string> joint_names;  ///< as in the file; equal names are kept
  std::vector<int> parents;              ///< -1 for the root
  Eigen::Matrix3Xd rest_offsets;         ///< (3 x J) from the parent, with all rotations zero
  std::vector<EndSite> end_sites;
  double frame_rate = 0;           ///< Hz
  std::vector<std::string> notes;  ///< oddities of the file, and how they were handled
  /// World rotation of joint j in frame t, at [t * J + j]: x_world = q x_joint + position.
  std::vector<Eigen::Quaterniond> rotations;
  std::vector<Eigen::Matrix3Xd> positions;  ///< per frame, (3 x J) world, meters
  std::map<std::string, int> humanoid;      ///< VRM's bones and their joints, if the file has them
  std::optional<Prop> prop;
  Eigen::VectorXd betas;           ///< of the body, if the file has them (Holdfast's do)
  std::string gender, body_model;  ///< likewise

  int NumJoints() const { return static_cast<int>(joint_names.size()); }
  int NumFrames() const { return static_cast<int>(positions.size()); }
  const Eigen::Quaterniond& Rotation(int frame, int joint) const {
    return rotations[static_cast<std::size_t>(frame) * joint_names.size() + joint];
  }
};

/// A joint without channels takes no text, but memory in every frame. Throws Error at the scanner's
/// line if `frames` of `joints` would take more than ten times the text they come from plus 60 MB,
/// or more than kMaxJointFrames.
void CheckMemoryBudget(const TextScanner& scanner, double frames, int joints,
                       std::size_t text_bytes);

/// Throws Error (`where`, with the field and the frame) for the first value that is not a number or
/// is outside the ranges of geometry/options.h.
void RequireInRange(const SourceMotion& motion, std::string_view where);

/// Names of the arrays in a parameter file.
enum class ParameterLayout {
  kAmass,   ///< AMASS: SMPL-X in parts, which is a clip; SMPL-H as `poses (T,156)`
  kPackage  ///< the smplx package's arguments: global_orient, body_pose, left_hand_pose, transl ...
};

/// Writes a motion's parameters for a family of models, as `.npz` (float64) or `.json` by the
/// path's extension, atomically.
///
/// kAmass: SMPL-X and MANO are clips (WriteClip); SMPL-H is `poses` (T,156), `trans` (T,3),
/// `betas`, `gender`, `mocap_framerate`.
/// kPackage: `global_orient` (T,3), `transl` (T,3), `betas` (1,B); for SMPL-X and SMPL-H also
/// `body_pose` (T,63), `left_hand_pose` and `right_hand_pose` (T,45); for SMPL-X also `jaw_pose`,
/// `leye_pose`, `reye_pose` (T,3); for MANO only `hand_pose` (T,45). In addition `flat_hand_mean`,
/// the convention of the finger angles, `model_type`, `gender`, `fps`.
///
/// `clip` holds the finger angles as they are written. Throws Error for another extension, and for
/// kAmass as `.json`.
void WriteParameters(const Clip& clip, ModelKind kind, ParameterLayout layout, bool flat_hand_mean,
                     const std::filesystem::path& path);

}  // namespace holdfast
