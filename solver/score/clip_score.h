// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "generator/walk_statistics/motion_metrics.h"
#include "geometry/clip/clip_body.h"
#include "geometry/options.h"
#include "geometry/parallel.h"
#include "geometry/score/contact_score.h"
#include "geometry/score/object_pose_error.h"
#include "geometry/score/own_body_score.h"
#include "solver/score/standing_score.h"

namespace holdfast {

/// Whether the intersection volume is measured exactly.
enum class ExactMode {
  kOff,   ///< by voxels only
  kAuto,  ///< exactly where defined, by voxels in other frames
  kOn,    ///< exactly or not at all: throws for an object without a volume
};

/// Whether an object is treated as symmetric when poses are compared.
enum class SymmetryMode { kAuto, kOn, kOff };

/// Published ways to score grasps, whose values of one name differ in definition, unit and mesh.
enum class ScoreProtocol { kNone, kGrab, kDexGraspNet, kGraspQp, kContactOpt, kV2d };

struct ScoreOptions {
  HandObjectProtocol hand_object;
  double deep_mm = kDeep_mm;  ///< penetration above which frames are counted
  ExactMode exact = ExactMode::kAuto;
  SymmetryMode symmetry = SymmetryMode::kAuto;
  ScoreProtocol protocol = ScoreProtocol::kNone;
  bool overlap = false;   ///< for different lengths: compare the common frames
  bool resample = false;  ///< for different frame rates: resample the reference
  int threads = 1;        ///< the result does not depend on it
};

/// Options of `score`.
OptionTable OptionsOf(ScoreOptions& options);

/// Sets the fields that follow from others: hand_object.measure_* and its threads. Throws Error if
/// no volume would be measured.
void SettleScoreOptions(ScoreOptions& options);

/// A clip compared to its reference.
struct ReferenceScore {
  std::string source;
  int frames = 0;  ///< compared, from the first on
  std::vector<JointError> joints;
  std::vector<ObjectPoseError> object;  ///< empty if either has no object
  double diameter_mm = 0.0;
  ObjectSymmetry symmetry;
};

/// All measurements of one clip.
struct ClipScore {
  std::string source;
  int frames = 0;
  double frame_rate = 0.0;
  std::vector<HandObjectScore> hands;    ///< holding hands; empty without an object
  std::optional<OwnBodyScore> own_body;  ///< none for a lone hand
  std::vector<std::uint8_t> in_air;      ///< FramesInMidAir; empty without an object
  std::vector<double> off_balance_m;     ///< OffBalance; empty for a lone hand
  MotionMetrics motion;
  std::optional<StandingScore> standing;  ///< none for a lone hand
  std::optional<VesselTilt> vessel;       ///< none without an object that has an opening
  std::optional<ReferenceScore> reference;
  /// Values of the protocol by key (ProtocolMetrics); none where undefined.
  std::map<std::string, std::optional<double>> by_protocol;
  bool foreign_body = false;
  std::vector<std::string> notes;
  // What the values depend on besides the options.
  std::string body, object_source, hands_by, inside_by;
  Eigen::Index hand_vertices = 0, hand_faces = 0, object_vertices = 0, object_faces = 0;
};

/// Measures a clip, against `reference` if given. Measures the hands that hold according to the
/// clip, else the nearer hand. `progress` receives "right hand", "left hand", "own body"; the
/// result is incomplete if it stops. Throws Error for a clip and a reference that cannot be
/// compared, and for an open surface if `options.exact` is kOn.
ClipScore ScoreClip(const ClipScene& input, const ClipScene* reference = nullptr,
                    const ScoreOptions& options = {}, const StagedProgress& progress = {});

}  // namespace holdfast
