// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "solver/robot/transfer_to_robot.h"
#include "solver/trial/trial.h"

namespace holdfast {

/// Writes one or two robot hands (of the same clip) and their object as a scene for MuJoCo, with
/// meshes in `x_assets` beside "x.xml", to be run in MuJoCo's own loop:
/// - a hand is a free body that a weld pulls to the mocap body `wrist_target` (contacts ignore a
///   mocap body's velocity: a carried object would be left behind);
/// - joints have limits, couplings and position actuators; arm joints are rigid;
/// - the object is free, with the mass and convex pieces of a trial (`solid`, by MakeTrialSolid);
/// - one key frame per frame: poses, position of `wrist_target`, and actuator targets. In frames of
///   the hold these exceed the pose by what the squeeze of a trial (BalancePresses) requires.
/// With two hands, all names of a hand begin with `right_` or `left_`; hands do not touch each
/// other.
void WriteRobotScene(std::span<const RobotInScene> robots, const TrialSolid& solid,
                     const std::filesystem::path& path);

/// How far the object strays from the clip's path when a transfer is played in MuJoCo: the scene of
/// WriteRobotScene, from the first to the last frame in which any of them holds, with gravity.
struct RobotPlay {
  std::vector<double> off_mm, off_deg;  ///< per frame; NaN where no hand holds
  double most_mm = 0.0, most_deg = 0.0;
  int holds = 0;       ///< number played
  bool stable = true;  ///< false: MuJoCo diverged

  bool Stays(double mm, double deg) const {
    return holds > 0 && stable && most_mm <= mm && most_deg <= deg;
  }
};

/// Throws Error without MuJoCo, and for an object without volume.
RobotPlay PlayRobotTransfer(std::span<const RobotInScene> robots, int threads = 1);

/// The first frame in which most parts of the human hand are in contact.
int FullestFrame(const HumanDemonstration& demonstration);

/// Tries whether a robot hand holds the object: links as hulls, joints as springs at their values,
/// otherwise the trial of human hands (TryHold). Nothing for hands with sliding joints. Throws
/// Error without MuJoCo.
std::optional<HoldTrial> TryRobotHold(const RobotTransferSetup& setup, const RobotPose& pose,
                                      const TrialSolid& solid, const TrialProtocol& protocol);

/// Tries the human hand that the robot's was derived from, in a frame of `clip`, which must be the
/// clip of `setup`'s scene.
HoldTrial TryHumanHold(const RobotTransferSetup& setup, const Clip& clip, int frame,
                       const TrialSolid& solid, const TrialProtocol& protocol);

}  // namespace holdfast
