// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/matching/body_frame.h"
#include "solver/take/take_plan.h"

namespace holdfast {

/// When what happens, in frames.
struct TakeTimes {
  int begin = 0;           ///< the arm leaves the motion's own
  int pregrasp = 0;        ///< the hand is on the line that it comes along
  int arrive = 0;          ///< the wrist is where the grasp has it, fingers still open
  int take = 0;            ///< the fingers are closed: the object is held from here on
  std::vector<int> goals;  ///< the object is at places[1 + k]
};

/// Times of a take by a body that is at the object in `reached[0]` and at the other places in the
/// rest: the fingers close in 0.3 s, some time within 0.4 s of `reached[0]` when the shoulder stays
/// best within the arm's length: of `pregrasp` while the hand comes along its line, of `wrist` from
/// arrival until the object is lifted. Throws Error when the frames do not ascend, are none, or
/// leave less than 0.8 s before the first.
TakeTimes TimesOfTake(std::span<const BodyPlacement> body, std::span<const int> reached,
                      const Eigen::Vector3d& pregrasp, const Eigen::Vector3d& wrist,
                      const ArmIk& arm, double frame_rate);

/// A body that comes to its place and leaves at once gives a hand no time to close. Slows the
/// motion down around frame `at` (to a quarter in the middle of 0.5 s, which takes 0.5 s longer)
/// unless the shoulder stays within 5 cm for 0.6 s there anyway. `reached` moves along.
void GiveTime(const Eigen::Matrix3Xd& rest_joints, int shoulder, int at, double frame_rate,
              std::vector<BodyFrame>& frames, std::vector<int>& reached);

/// Where things are carried: frames that follow the chest, but upright, turned as the chest faces
/// (x ahead, y to its left, z up) and steadied over 0.15 s.
std::vector<Eigen::Isometry3d> CarryFrames(std::span<const BodyPlacement> body, double frame_rate);

/// A pose of the upright object: place of its frame's origin, turn about the vertical.
struct UprightPose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
  Eigen::Isometry3d Transform() const;
};

/// Where in a carry frame the object is comfortable: upright, the forearm about level before the
/// body, the elbow near a right angle, turned little from how it was taken; least discomfort over
/// `frames` of the motion.
UprightPose ComfortableCarry(const ArmIk& arm, const TakeCandidate& take, const TakeObject& object,
                             std::span<const BodyPlacement> body,
                             std::span<const Eigen::Isometry3d> carry_frames, int take_frame,
                             std::span<const int> frames);

/// How quickly the object follows the body.
struct CarryPace {
  double leave_s = 0.25;  ///< from the take until it begins to
  double follow_s = 0.9;  ///< until it has left its place, and another place later
  double bring_s = 0.9;   ///< from carrying to a place
};

/// The object's wished way from the take on, upright throughout, one pose per frame of the motion
/// (before the take it stands): lifted 6 cm while the hand begins to follow the body, no
/// lower until it is 12 cm off its place and at will from 50 cm on, carried in `carry`,
/// brought to `at_goals[k]` by TakeTimes::goals[k], where it stays 0.4 s; at the last it then stays
/// with the body, a third of the way back to where it is carried. All changes are minimum-jerk.
std::vector<Eigen::Isometry3d> ObjectWay(const TakeTimes& times, const UprightPose& standing,
                                         const UprightPose& carry,
                                         std::span<const UprightPose> at_goals,
                                         std::span<const Eigen::Isometry3d> carry_frames,
                                         double frame_rate, const CarryPace& pace = {});

}  // namespace holdfast
