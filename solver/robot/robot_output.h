// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

#include "geometry/clip/clip_body.h"
#include "geometry/render/image.h"
#include "solver/robot/robot_measures.h"
#include "solver/robot/transfer_to_robot.h"

namespace holdfast {

/// The motion as arrays (`.npz`, float64): `joint_names` (a text, names between commas),
/// `joint_angles (T,J)` of all joints, followers too, radians or meters; `wrist_trans (T,3)`,
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

struct RobotPictureOptions {
  int width = 420, height = 360;
  int columns = 4, rows = 3;
  bool human = true;  ///< the human hand beside each picture of the robot's
  int threads = 1;
};

/// A sheet of the robot's hand and the object in frames spread over the hold, seen towards the palm
/// and from the thumb's side by turns, in the object's frame; the human hand beside each.
Image RobotSheet(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                 const RobotPictureOptions& options);

/// The whole clip, `columns` times `rows` frames spread over it: the robot's hand and the object,
/// seen from one direction of the world, from the palm's side, the camera going along.
Image RobotFilm(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                const RobotPictureOptions& options);

}  // namespace holdfast
