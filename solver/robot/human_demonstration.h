// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip_body.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/robot/robot_anatomy.h"
#include "solver/robot/robot_term.h"
#include "solver/robot/robot_terms.h"

namespace holdfast {

/// One frame of the human hand, in the object's frame.
struct HumanFrame {
  Eigen::Matrix3Xd vertices;  ///< of the hand, meters
  Eigen::VectorXd distance;   ///< signed, of the vertices to the object; beyond 5 cm a lower bound
  Eigen::Isometry3d object_from_wrist = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  Eigen::Matrix<double, 3, kJointsPerHand> joints;  ///< positions, file order
  Eigen::Matrix<double, 3, kNumFingers> tips;       ///< indexed by Finger
  bool holds = false;
  std::vector<PartContact> contacts;  ///< while holding: one for each part in contact
};

/// Per-frame state of the human hand relative to the object in a clip.
struct HumanDemonstration {
  Side side = Side::kRight;
  double frame_rate = 30.0;
  std::vector<HumanFrame> frames;
};

/// Skin closer than this is in contact. A part's contact is the mean of its touching skin, with
/// closer skin weighted more.
inline constexpr double kDemonstratedTouch_m = 0.004;

/// Reads the demonstration of one hand. Throws Error (`scene.source`) for a clip without an object
/// track or mesh, or in which the hand never touches the object.
HumanDemonstration ReadDemonstration(const ClipScene& scene, const HandModel& hand,
                                     const HandLandmarks& landmarks, const HandAxes& axes,
                                     const SignedDistance& object);

/// Whether the human's grasp is the same in both frames: the same parts are in contact, and no skin
/// within 2 cm of the object has moved relative to it by more than 0.25 mm.
bool SameGrasp(const HumanFrame& a, const HumanFrame& b);

/// Returns the frame with the most contacts; the middle one of ties.
int AnchorFrame(const HumanDemonstration& demonstration);

/// Returns the hand that holds the object in more frames; without holding_hand, the nearer one.
Side HoldingSide(const ClipScene& scene, const SignedDistance& object);

/// A point on a robot hand that corresponds to a human joint or fingertip.
struct RobotKeypoint {
  int link = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< in the link's frame

  Eigen::Vector3d At(const PosedRobot& robot) const { return robot.ObjectFromLink(link) * point; }
};

/// Points of a robot hand for palm, finger joints and fingertips, and the corresponding human
/// points in the object's frame.
struct RobotKeypoints {
  RobotKeypoints(const RobotHand& hand, const RobotAnatomy& anatomy);

  RobotKeypoint palm;                 ///< mean of the knuckles
  std::vector<RobotKeypoint> joints;  ///< three per finger, in the order of RobotAnatomy::fingers
  std::vector<RobotKeypoint> tips;    ///< one per finger
  std::vector<int> human_fingers;     ///< corresponding human fingers (Finger)

  Eigen::Matrix3Xd HumanTips(const HumanFrame& frame) const;
  Eigen::Matrix3Xd HumanJoints(const HumanFrame& frame) const;
};

inline RobotKeypoints::RobotKeypoints(const RobotHand& hand, const RobotAnatomy& anatomy) {
  RobotState state(hand);
  state.Evaluate(hand.Straight());
  const auto add = [&](int link, const Eigen::Vector3d& in_root) {
    return RobotKeypoint{link, state.RootFromLink(link).inverse() * in_root};
  };
  const int palm_link = anatomy.palm_links.front();
  palm = add(palm_link, anatomy.knuckles);
  for (const RobotFinger& finger : anatomy.fingers) {
    human_fingers.push_back(finger.human);
    // A phalanx without links of its own moves with the preceding one.
    int last = palm_link;
    for (int p = 0; p < 3; ++p) {
      if (!finger.links[p].empty()) last = finger.links[p].front();
      joints.push_back(add(last, finger.nodes[p]));
      if (!finger.links[p].empty()) last = finger.links[p].back();
    }
    tips.push_back(add(last, finger.nodes[3]));
  }
}

inline Eigen::Matrix3Xd RobotKeypoints::HumanTips(const HumanFrame& frame) const {
  return frame.tips(Eigen::all, human_fingers);
}

inline Eigen::Matrix3Xd RobotKeypoints::HumanJoints(const HumanFrame& frame) const {
  Eigen::Matrix3Xd out(3, static_cast<Eigen::Index>(joints.size()));
  for (Eigen::Index i = 0; i < out.cols(); ++i) {
    out.col(i) = frame.joints.col(3 * human_fingers[i / 3] + i % 3);
  }
  return out;
}

}  // namespace holdfast
