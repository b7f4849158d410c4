// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/matching/body_frame.h"
#include "solver/take/take_plan.h"

namespace holdfast {

/// Events of a take, in frames.
struct TakeTimes {
  int begin = 0;           ///< the arm departs from the body motion
  int pregrasp = 0;        ///< the hand is on the approach line
  int arrive = 0;          ///< the wrist is at the grasp, fingers still open
  int take = 0;            ///< the fingers are closed: the object is held from here on
  std::vector<int> goals;  ///< the object is at places[1 + k]
};

/// Times a take by a body that is at the object in `reached[0]` and at the other places in the
/// rest. The fingers close in 0.3 s, within 0.4 s of `reached[0]`, when the shoulder stays best
/// within the arm's length: of `pregrasp` during the approach along the line, of `wrist` from
/// arrival until the object is lifted. Throws Error if the frames do not ascend, are empty, or
/// leave less than 0.8 s before the first.
TakeTimes TimesOfTake(std::span<const BodyPlacement> body, std::span<const int> reached,
                      const Eigen::Vector3d& pregrasp, const Eigen::Vector3d& wrist,
                      const ArmIk& arm, double frame_rate);

/// Gives the hand time to close if the body would leave its place at once: slows the motion down
/// around frame `at` (to a quarter in the middle of 0.5 s, which takes 0.5 s longer), unless the
/// shoulder stays within 5 cm for 0.6 s there. Updates `reached`.
void GiveTime(const Eigen::Matrix3Xd& rest_joints, int shoulder, int at, double frame_rate,
              std::vector<BodyFrame>& frames, std::vector<int>& reached);

/// Returns carry frames that follow the chest: upright, with the chest's heading (x ahead, y to its
/// left, z up) and smoothed over 0.15 s.
std::vector<Eigen::Isometry3d> CarryFrames(std::span<const BodyPlacement> body, double frame_rate);

/// Pose of an upright object: position of its frame's origin, rotation about the vertical.
struct UprightPose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
  Eigen::Isometry3d Transform() const;
};

/// Returns a comfortable object pose in a carry frame: upright, the forearm about level in front of
/// the body, the elbow near a right angle, rotated little since the take; minimizes discomfort over
/// `frames` of the motion.
UprightPose ComfortableCarry(const ArmIk& arm, const TakeCandidate& take, const TakeObject& object,
                             std::span<const BodyPlacement> body,
                             std::span<const Eigen::Isometry3d> carry_frames, int take_frame,
                             std::span<const int> frames);

/// Returns the object's target path from the take on, upright throughout, one pose per frame
/// (standing before the take): lifted by 6 cm while it begins to follow the body, kept at that
/// height until 12 cm from its place and unconstrained from 50 cm on, carried at `carry`, moved to
/// `at_goals[k]` by TakeTimes::goals[k], where it stays for 0.4 s. At the last one it then moves
/// with the body, a third of the way back to `carry`. All transitions are minimum-jerk. Timing:
/// from the take to the start of following, to leave its place (also at later places), and from
/// carrying to a place.
std::vector<Eigen::Isometry3d> ObjectWay(const TakeTimes& times, const UprightPose& standing,
                                         const UprightPose& carry,
                                         std::span<const UprightPose> at_goals,
                                         std::span<const Eigen::Isometry3d> carry_frames,
                                         double frame_rate, double leave_s = 0.25,
                                         double follow_s = 0.9, double bring_s = 0.9);

}  // namespace holdfast
