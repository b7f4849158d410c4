// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "geometry/clip/clip_body.h"
#include "geometry/render/image.h"
#include "solver/robot/robot_measures.h"
#include "solver/robot/transfer_to_robot.h"

namespace holdfast {

/// Writes the motion as arrays (`.npz`, float64): `joint_names` (comma-separated text),
/// `joint_angles (T,J)` of all joints including followers, radians or meters; `wrist_trans (T,3)`
/// and `wrist_orient (T,3)`, position and axis-angle of the robot's root in the world;
/// `object_trans`, `object_orient`; `frame_rate`; and for all contacts: `contact_frame`,
/// `contact_point (C,3)`, `contact_normal (C,3)` (world, robot surface), `contact_link` (index of
/// `link_names`), `contact_part`, `contact_distance_m`. Throws Error if the file cannot be written.
void WriteRobotMotion(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                      const RobotMeasures& measures, const std::filesystem::path& path);

/// Writes the motion by the schema `motion_v1` of NVIDIA's video_to_data (`.npz`, a field of the
/// schema per array, nested lists as arrays with a first axis of one hand): a `single_robot` whose
/// root is the robot's, world frame, z up, quaternions wxyz, float32. `object_mesh`: its path for
/// the field `object_mesh_paths`. docs/robots.md turns the file into their Parquet.
void WriteMotionV1(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                   const RobotMeasures& measures, const std::string& sequence,
                   const std::string& object_mesh, const std::filesystem::path& path);

/// Writes the motion as a table, one line per frame: frame, time_s, wrist (x, y, z, qw, qx, qy,
/// qz), object (same), joints by name.
void WriteRobotTable(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                     const std::filesystem::path& path);

/// Renders a sheet of robot hand and object in frames spread over the hold, alternately facing the
/// palm and from the thumb's side, in the object's frame; the human hand beside each.
Image RobotSheet(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses, int columns,
                 int rows, int threads);

/// Renders the whole clip as `columns` times `rows` frames: one or two robot hands and the object,
/// from a fixed world direction on the first palm's side, with a tracking camera.
Image RobotFilm(std::span<const RobotInScene> robots, int columns, int rows, int threads);

}  // namespace holdfast
