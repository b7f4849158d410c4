// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "geometry/clip/clip_body.h"
#include "solver/evaluation/robot_baselines.h"
#include "solver/robot/robot_measures.h"
#include "solver/trial/trial.h"

namespace holdfast {

/// One clip on one robot's hand by one method.
struct RobotStudyRow {
  std::string robot, clip, method;
  RobotMeasures measures;
  double ms_per_frame = 0.0;  ///< of solving, one core, the first frame's starts apart
  std::optional<int> held;    ///< directions of 6 in which the frame with most contacts holds
};

struct RobotStudyOptions {
  RobotTransferOptions transfer;
  bool baselines = true;
  bool physics = true;  ///< trials, where this build has MuJoCo and all the robot's joints turn
  TrialProtocol protocol;
};

/// Transfers a clip by our method and by those of RobotBaseline, and measures all alike; after them
/// the human hand ("human hand": what can be asked for). Throws Error as PrepareRobotTransfer does.
std::vector<RobotStudyRow> StudyTransfer(const ClipScene& scene, const RobotHand& robot,
                                         const RobotStudyOptions& options);

/// Whether a robot's hand keeps the object: its links as hulls, joints as springs where they stand,
/// the trial otherwise that of human hands (TryHold). Nothing without MuJoCo, and for hands with
/// sliding joints.
std::optional<HoldTrial> TryRobotHold(const RobotTransferSetup& setup, const RobotPose& pose,
                                      const TrialSolid& solid, const TrialProtocol& protocol);

}  // namespace holdfast
