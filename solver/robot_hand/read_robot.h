// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

#include "solver/robot_hand/robot_hand.h"

namespace holdfast {

/// Reads a robot hand: URDF (`.urdf`, by urdfdom) or MJCF (`.xml`, by MuJoCo). Mesh files (.obj,
/// .stl, .ply, .off) are looked for beside the file, as it names them, and `package://name/...` in
/// the folders above it. What a link shows is its shape; what collides, where it shows nothing.
/// Limits are the file's; joints without any turn freely within a turn. The file is checked first
/// (CheckRobotFile), and its library runs in a process of its own (ReadInProcess).
///
/// Throws Error for a file that is neither, is not well-formed, has no joint that moves or more
/// than 200 that move on their own; for what CheckRobotFile and ReadInProcess refuse; for meshes
/// that are missing or cannot be read; for mimics of joints that are not there; for a hand larger
/// than 2 m or smaller than 2 cm (a file in millimetres); and where this build has no library for
/// the format.
RobotHand ReadRobotHand(const std::filesystem::path& path);

/// The readers of each format, in this process and without any of these checks. `text`: the file's.
RobotHand ReadUrdf(const std::filesystem::path& path, const std::string& text);
RobotHand ReadMjcf(const std::filesystem::path& path);

}  // namespace holdfast
