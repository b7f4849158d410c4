// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "generator/walk_statistics/joint_error.h"
#include "generator/walk_statistics/motion_metrics.h"
#include "geometry/clip/clip_body.h"
#include "geometry/parallel.h"
#include "geometry/score/contact_score.h"
#include "geometry/score/object_pose_error.h"
#include "geometry/score/own_body_score.h"

namespace holdfast {

/// Whether the shared volume is measured exactly.
enum class ExactMode {
  kOff,   ///< by voxels alone
  kAuto,  ///< exactly where it is defined, by voxels in the other frames
  kOn,    ///< exactly or not at all: an object that bounds no volume is an error
};

/// Whether an object is taken as symmetric when poses are compared.
enum class SymmetryMode { kAuto, kOn, kOff };

struct ScoreOptions {
  HandObjectProtocol hand_object;
  double deep_mm = kDeep_mm;  ///< frames with penetration deeper than this are counted
  ExactMode exact = ExactMode::kAuto;
  SymmetryMode symmetry = SymmetryMode::kAuto;
  bool overlap = false;   ///< clip and reference of different lengths: compare what both have
  bool resample = false;  ///< of different frame rates: resample the reference
  int threads = 1;        ///< the result does not depend on them
};

/// A clip against its reference, over the frames compared.
struct ReferenceScore {
  std::string source;
  int frames = 0;  ///< compared, from the first on
  std::vector<JointError> joints;
  std::vector<ObjectPoseError> object;  ///< empty when one of both has no object
  double diameter_mm = 0.0;
  ObjectSymmetry symmetry;
};

/// All that is measured of one clip.
struct ClipScore {
  std::string source;
  int frames = 0;
  double frame_rate = 0.0;
  std::vector<HandObjectScore> hands;    ///< those that hold; empty without an object
  std::optional<OwnBodyScore> own_body;  ///< nothing for a hand alone
  MotionMetrics motion;
  std::optional<ReferenceScore> reference;
  bool foreign_body = false;
  std::vector<std::string> notes;
  // What the numbers depend on besides the options.
  std::string body, object_source, hands_by, inside_by;
  Eigen::Index hand_vertices = 0, hand_faces = 0, object_vertices = 0, object_faces = 0;
};

/// Measures a clip, against `reference` if there is one; hands that hold as the clip says, else the
/// nearer one. `progress` sees "right hand", "left hand", "own body"; what it stops is incomplete.
/// Throws Error for a clip and a reference that cannot be compared, and for a surface that is open
/// where `options.exact` is kOn.
ClipScore ScoreClip(const ClipScene& input, const ClipScene* reference = nullptr,
                    const ScoreOptions& options = {}, const StagedProgress& progress = {});

}  // namespace holdfast
