// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "solver/robot_hand/robot_hand.h"

namespace holdfast {

/// Reads a robot hand: URDF (`.urdf`, by urdfdom) or MJCF (`.xml`, by MuJoCo). Mesh files (.obj,
/// .stl, .ply, .off) are looked for beside the file, as it names them, and `package://name/...` in
/// the folders above it. What a link shows is its shape; what collides, where it shows nothing.
/// Limits are the file's; joints without any turn freely within a turn.
///
/// Throws Error for a file that is neither, is not well-formed, or has no joint that moves; for
/// meshes that are missing or cannot be read; for mimics of joints that are not there; for a hand
/// larger than 2 m or smaller than 2 cm (a file in millimetres); and where this build has no
/// library for the format.
RobotHand ReadRobotHand(const std::filesystem::path& path);

/// The readers of each format, without the checks on the whole.
RobotHand ReadUrdf(const std::filesystem::path& path);
RobotHand ReadMjcf(const std::filesystem::path& path);

}  // namespace holdfast
