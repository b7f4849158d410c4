// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

#include "solver/robot/robot_measures.h"
#include "solver/robot/transfer_to_robot.h"

namespace holdfast {

/// The motion as arrays (`.npz`, float64): `joint_names` (a text, names between commas),
/// `joint_angles (T,J)` of all joints, followers too, radians or metres; `wrist_trans (T,3)`,
/// `wrist_orient (T,3)` axis-angle of the robot's root in the world; `object_trans`,
/// `object_orient`; `frame_rate`; and of all contacts: `contact_frame`, `contact_point (C,3)`,
/// `contact_normal (C,3)` (world, of the robot's surface), `contact_link` (of `link_names`),
/// `contact_part`, `contact_distance_m`. Throws Error where it cannot be written.
void WriteRobotMotion(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                      const RobotMeasures& measures, const std::filesystem::path& path);

/// The same as a table, a line a frame: frame, time_s, wrist (x, y, z, qw, qx, qy, qz), object (the
/// same), joints by name.
void WriteRobotTable(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                     const std::filesystem::path& path);

}  // namespace holdfast
