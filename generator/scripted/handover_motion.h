// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/scripted/reach_motion.h"
#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// How one hand holds an object.
struct HandoverGrasp {
  Eigen::Isometry3d wrist_from_object = Eigen::Isometry3d::Identity();  ///< meters
  FingerPose fingers = FingerPose::Zero();
};

/// How both hands hold the same object at once, as they do while it changes hands.
struct HandoverGrasps {
  HandoverGrasp right, left;
  /// How the object is turned where the hands meet: world orientation for a person who faces -y.
  Eigen::Matrix3d presented = Eigen::Matrix3d::Identity();

  const HandoverGrasp& Of(Side side) const { return side == Side::kRight ? right : left; }
  HandoverGrasp& Of(Side side) { return side == Side::kRight ? right : left; }
};

/// Flat palms on either side of an object (vertices 3 x n, object frame, meters), thumbs up and
/// fingers forward, each palm on the object's outermost point in its direction; the turn of the
/// object and the hands vary with the seed. The fingers are curled by the object's size alone:
/// callers that have the surface may close them on it.
HandoverGrasps PalmGrasps(const BodyMeasures& body, const Eigen::Matrix3Xd& object_vertices,
                          std::uint64_t seed);

struct HandoverOptions {
  int switches = 0;                ///< how often the object changes hands; 0: one to three, drawn
  std::optional<Side> first_hand;  ///< who has it first; none: drawn
  double min_dwell_s = 0.1;        ///< both hands hold for at least, at most this long
  double max_dwell_s = 0.5;
  double frame_rate = 30.0;  ///< Hz
  std::uint64_t seed = 1;    ///< of hands, times, places and speeds
};

/// A clip in which an object changes hands, and its ground truth.
struct HandoverMotion {
  Clip clip;                       ///< with object track and `holding_hand`, the ground truth
  std::vector<int> switch_frames;  ///< frame nearest to the middle of each dwell
  Side first_hand = Side::kRight;
};

/// A standing person carries an object in one hand, brings both hands together in front of the
/// body, holds it with both for a moment, and goes on with the other hand; the free hand hangs or
/// waits at the waist. All movements are minimum-jerk. The object is rigid in the frame of the
/// wrist that holds it, and in those of both wrists while both hold. Deterministic for a seed.
/// Throws Error for fewer than no or more than 20 switches, dwells that are not 0 <= min <= max, a
/// frame rate that is not positive, and grasps that bring no two comfortable hands together.
HandoverMotion MakeHandoverMotion(const BodyMeasures& body, const HandoverGrasps& grasps,
                                  const HandoverOptions& options = {});

/// Standard deviations, per axis and frame, independent of each other.
struct ClipNoise {
  double object_m = 0.0;
  double object_rad = 0.0;
  double joint_rad = 0.0;  ///< root, body and finger joints
};

/// Disturbs a clip as a noisy capture or a network does. The object need not be there.
void AddNoise(Clip& clip, const ClipNoise& noise, std::uint64_t seed);

}  // namespace holdfast
