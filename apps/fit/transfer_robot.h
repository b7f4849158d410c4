// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "solver/robot/robot_measures.h"
#include "solver/robot/transfer_to_robot.h"

namespace holdfast::apps {

/// What 'holdfast transfer --robot' asks for.
struct RobotTransferInput {
  std::string robot;           ///< URDF or MJCF; empty: another transfer
  std::string correspondence;  ///< CSV; empty: found
  std::string hand = "auto";
  bool on_path = false;
  int picture_columns = 4, picture_rows = 4;
  int film_columns = 6, film_rows = 4;
};

/// Adds --robot, --hand, --correspondence, --robot-on-path.
void AddRobotOptions(CLI::App& command, RobotTransferInput& input);

/// Transfers the clip to the robot and writes the result folder `output`: robot.npz, robot.csv,
/// scene.xml with scene_assets, correspondence.csv, sheet.png, film.png, report.html, metrics.json.
/// Returns the exit code.
int RunRobotTransfer(const std::string& clip, const ClipInputOptions& clip_input,
                     const RobotTransferInput& input, const std::string& output,
                     const CommonOptions& common);

/// The page of a clip on a robot's hand: how well contacts are kept, over the frames, the sheet of
/// pictures (`sheet`, a file beside the page), each joint's path within its limits, and which link
/// stands for which part of a hand.
std::string RobotPage(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                      const RobotMeasures& measures, const std::string& sheet);

}  // namespace holdfast::apps
