// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/clip/clip.h"
#include "geometry/retarget/retarget.h"

namespace holdfast {

struct ImportOptions {
  double frame_rate = 30;        ///< of the clip, Hz; 0 keeps the file's
  double source_frame_rate = 0;  ///< Hz, for files that do not tell (AMC: 120); 0: as the file says
  double meters_per_unit = 0;  ///< 0: 0.01 for BVH, 1 for glTF, the skeleton's own unit for ASF/AMC
  std::optional<UpAxis> up;    ///< of the file's world; empty: judged from the posture
  std::filesystem::path map;   ///< JSON map of joint names; empty: recognized
  std::filesystem::path skeleton;          ///< `.asf` of an `.amc`; empty: looked for beside it
  bool find_ground = true;                 ///< see RetargetOptions
  Eigen::VectorXd betas;                   ///< of the body given, noted in the clip
  std::string animation, character, prop;  ///< choices within a glTF, see GltfMotionOptions
};

struct ImportReport {
  std::string format;    ///< "BVH", "ASF/AMC", "glTF" or "SkillMimic"
  std::string skeleton;  ///< naming recognized, or the map's file name
  int source_joints = 0;
  int mapped_joints = 0;
  std::vector<std::string> unused_source_joints;
  std::vector<std::string> missing_body_joints;  ///< of the first 22 of SMPL-X, filled in
  std::vector<std::string> notes;  ///< oddities of the file, and what was decided on the way
  UpAxis up = UpAxis::kY;          ///< of the file's world
  int source_frames = 0;
  double source_frame_rate = 0;
  int frames = 0;
  RetargetReport retarget;
};

/// What is said of FBX wherever it turns up.
inline constexpr const char* kFbxProblem =
    "FBX is neither read nor written, .glb is: Blender converts one to the other";

/// True when the file begins like a motion that ReadMotion knows (BVH, AMC, glTF; markers and FBX,
/// to be told why not), whatever its name.
bool LooksLikeMotionFile(const std::filesystem::path& path);

/// Reads a BVH, an ASF/AMC or a glTF motion, recognized by content, plain or gzip'd. Throws Error
/// for files that are none of them (markers are told why) or malformed.
SourceMotion ReadMotion(const std::filesystem::path& path, const ImportOptions& options = {});

/// Brings a motion onto a body; `where` names its file in messages. Throws Error for skeletons that
/// cannot be mapped. The clip's gender is the file's where that tells; shape and `body_model` are
/// the caller's, who made `body` (motion.betas tells the file's).
Clip ImportMotion(const SourceMotion& motion, const std::string& where, const RetargetBody& body,
                  const ImportOptions& options = {}, ImportReport* report = nullptr);

/// ReadMotion and ImportMotion in one.
Clip ImportMotion(const std::filesystem::path& path, const RetargetBody& body,
                  const ImportOptions& options = {}, ImportReport* report = nullptr);

}  // namespace holdfast
