// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "solver/robot/robot_measures.h"
#include "solver/robot/transfer_to_robot.h"

namespace holdfast::apps {

/// Inputs of 'holdfast transfer --robot'.
struct RobotTransferInput {
  std::vector<std::string> robots;  ///< URDF or MJCF; two: a hand of each side; empty: no transfer
  std::string correspondence;       ///< CSV; empty: determined automatically
  RobotTransferOptions options;
  int picture_columns = 4, picture_rows = 4;
  int film_columns = 6, film_rows = 4;
};

/// Adds --robot, --hand, --correspondence, --robot-on-path.
void AddRobotOptions(CLI::App& command, RobotTransferInput& input);

/// Transfers the clip to the robots and writes the result folder `output`: robot.npz, robot.csv,
/// scene.xml with scene_assets, correspondence.csv, sheet.png, film.png, report.html, metrics.json.
/// With two robots, scene, film and metrics of both, and the rest in folders `right` and `left`.
/// Returns the exit code.
int RunRobotTransfer(const std::string& clip, const ClipInputOptions& clip_input,
                     const RobotTransferInput& input, const std::string& output,
                     const CommonOptions& common);

/// Returns the page of a clip on a robot hand: contact preservation over the frames, the sheet of
/// pictures (`sheet`, a file next to the page), the path of each joint within its limits, and the
/// correspondence of links to hand parts. If the program has the player, its contacts can be edited
/// in the page, which shows the `command` that uses them.
std::string RobotPage(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                      const RobotMeasures& measures, const std::string& sheet,
                      const std::string& command);

}  // namespace holdfast::apps
