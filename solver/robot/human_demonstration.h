// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip_scene.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/robot/robot_contact_term.h"

namespace holdfast {

/// A frame of the human hand, in the object's frame.
struct HumanFrame {
  Eigen::Matrix3Xd vertices;  ///< of the hand, metres
  Eigen::VectorXd distance;   ///< signed, of those from the object; beyond 5 cm a lower bound
  Eigen::Isometry3d object_from_wrist = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  Eigen::Matrix<double, 3, kJointsPerHand> joints;  ///< positions, file order
  Eigen::Matrix<double, 3, kNumFingers> tips;       ///< by Finger
  bool holds = false;
  std::vector<PartContact> contacts;  ///< where it holds: one a part that touches
};

/// What the human hand does with the object in a clip, frame by frame.
struct HumanDemonstration {
  Side side = Side::kRight;
  double frame_rate = 30.0;
  std::vector<HumanFrame> frames;
};

struct DemonstrationOptions {
  std::optional<Side> side;  ///< nothing: the hand that holds longer
  /// Skin closer than this touches; a part's contact is where it touches, nearer skin counting
  /// more.
  double touch_m = 0.004;
};

/// The hand that is transferred. Throws Error (`scene.source`) for a clip without an object's track
/// or its mesh, or in which the hand never touches the object.
HumanDemonstration ReadDemonstration(const ClipScene& scene, const HandModel& hand,
                                     const HandLandmarks& landmarks, const HandAxes& axes,
                                     const SignedDistance& object, double touch_m);

/// Whether the human's grasp is the same in both frames: the same parts touch, and no skin within
/// 2 cm of the object has moved on it by more than a quarter of a millimetre.
bool SameGrasp(const HumanFrame& a, const HumanFrame& b);

/// The hand of a clip that holds the object in more frames; without holding_hand the nearer one.
Side HoldingSide(const ClipScene& scene, const SignedDistance& object);

}  // namespace holdfast
