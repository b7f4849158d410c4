// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/clip/clip.h"
#include "geometry/import/fields.h"
#include "geometry/retarget/retarget.h"

namespace holdfast {

struct ImportOptions : FileFacts {
  double frame_rate = 30;            ///< Hz, of the clip; 0 keeps the file's
  std::string map;                   ///< JSON map of joint names; empty: recognized
  std::string skeleton;              ///< `.asf` of an `.amc`; empty: searched next to it
  Eigen::VectorXd betas;             ///< shape of the given body, stored in the clip
  std::string animation, character;  ///< choices within a glTF, see GltfMotionOptions
};

struct ImportReport {
  std::string format;    ///< "BVH", "ASF/AMC", "glTF", "SkillMimic" ...
  std::string skeleton;  ///< recognized naming, or the map's file name
  int source_joints = 0;
  int mapped_joints = 0;
  std::vector<std::string> unused_source_joints;
  std::vector<std::string> missing_body_joints;  ///< of the first 22 of SMPL-X; filled in
  std::vector<std::string> notes;                ///< oddities of the file, and decisions made
  UpAxis up = UpAxis::kY;                        ///< up axis of the file's world
  int source_frames = 0;
  double source_frame_rate = 0;
  int frames = 0;
  RetargetReport retarget;
};

/// Error text for FBX files.
inline constexpr const char* kFbxProblem =
    "FBX is not supported: convert to or from .glb with Blender";

/// Whether the file begins like a motion that ReadMotion knows (BVH, AMC, glTF, arrays),
/// whatever its name. Also true for markers and FBX, for which ReadMotion reports the reason.
bool LooksLikeMotionFile(const std::filesystem::path& path);

/// Reads a BVH, ASF/AMC or glTF motion, detected from the content, plain or gzipped. Throws Error
/// for any other file (for markers, with the reason) and for malformed files.
SourceMotion ReadMotion(const std::filesystem::path& path, const ImportOptions& options = {});

/// Retargets a motion to a body; `where` names its file in messages. Throws Error for skeletons
/// that cannot be mapped. The clip's gender is the file's if it has one. Shape and `body_model` are
/// up to the caller, who made `body` (motion.betas holds the file's shape).
Clip ImportMotion(const SourceMotion& motion, const std::string& where, const RetargetBody& body,
                  const ImportOptions& options = {}, ImportReport* report = nullptr);

/// Calls ReadMotion and ImportMotion.
Clip ImportMotion(const std::filesystem::path& path, const RetargetBody& body,
                  const ImportOptions& options = {}, ImportReport* report = nullptr);

}  // namespace holdfast
