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

/// Grasp of one hand on an object.
struct HandoverGrasp {
  Eigen::Isometry3d wrist_from_object = Eigen::Isometry3d::Identity();  ///< meters
  FingerPose fingers = FingerPose::Zero();
};

/// Grasps of both hands on the same object, held at the same time during a handover.
struct HandoverGrasps {
  HandoverGrasp right, left;
  /// World orientation of the object where the hands meet, for a person who faces -y.
  Eigen::Matrix3d presented = Eigen::Matrix3d::Identity();

  const HandoverGrasp& Of(Side side) const { return side == Side::kRight ? right : left; }
  HandoverGrasp& Of(Side side) { return side == Side::kRight ? right : left; }
};

/// Generates grasps with flat palms on either side of an object (vertices 3 x n, object frame,
/// meters): thumbs up, fingers forward, each palm on the outermost point of the object in its
/// direction. The orientation of the object and the hands vary with the seed. The fingers are
/// curled by the object's size only; callers that have the surface may close the fingers on it.
HandoverGrasps PalmGrasps(const BodyMeasures& body, const Eigen::Matrix3Xd& object_vertices,
                          std::uint64_t seed);

struct HandoverOptions {
  int switches = 0;                ///< number of handovers; 0: one to three, drawn
  std::optional<Side> first_hand;  ///< hand that starts with the object; if empty: drawn
  double min_dwell_s = 0.1;        ///< minimum and maximum time that both hands hold
  double max_dwell_s = 0.5;
  double frame_rate = 30.0;  ///< Hz
  std::uint64_t seed = 1;    ///< of hands, times, places and speeds
};

/// A clip with handovers of an object, and its ground truth.
struct HandoverMotion {
  Clip clip;                       ///< with object track and ground-truth `holding_hand`
  std::vector<int> switch_frames;  ///< frame nearest to the middle of each dwell
  Side first_hand = Side::kRight;
};

/// Generates a clip in which a standing person carries an object in one hand, brings both hands
/// together in front of the body, holds it with both for a moment, and continues with the other
/// hand. The free hand hangs or waits at the waist. All movements are minimum-jerk. The object is
/// rigid in the frame of the holding wrist, and of both wrists while both hold. Deterministic for a
/// seed. Throws Error for a number of switches below 0 or above 20, dwells other than 0 <= min <=
/// max, a frame rate that is not positive, and grasps without a comfortable meeting of the hands.
HandoverMotion MakeHandoverMotion(const BodyMeasures& body, const HandoverGrasps& grasps,
                                  const HandoverOptions& options = {});

/// Standard deviations per axis and frame, independent of each other.
struct ClipNoise {
  double object_m = 0.0;
  double object_rad = 0.0;
  double joint_rad = 0.0;  ///< root, body and finger joints
};

/// Adds noise to a clip, as in a noisy capture or the output of a network. The object is optional.
void AddNoise(Clip& clip, const ClipNoise& noise, std::uint64_t seed);

}  // namespace holdfast
