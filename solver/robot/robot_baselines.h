// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "solver/robot/transfer_to_robot.h"

namespace holdfast {

/// Published transfer methods, reimplemented from their papers for comparison.
enum class RobotBaseline {
  /// Fingertip vectors (DexPilot, Handa et al. 2020, eq. 1-4, with its weights and distances;
  /// vectors scaled by the ratio of finger lengths). The palm is aligned with the human's.
  kFingertipVectors,
  /// Inverse kinematics of fingertips and wrist, as commonly set up with Mink.
  kKeypoints,
  /// Laplacian of an interaction mesh of 21 hand points and 60 object points, without penetration
  /// of the object (OmniRetarget, Yang et al. 2025). Edges: the Gabriel graph, i.e. Delaunay edges
  /// whose diametral ball is empty. Its constraints are penalties here.
  kLaplacian,
};

std::string_view BaselineName(RobotBaseline baseline);

/// Solves frame by frame, each initialized from the previous frame.
RobotTransfer TransferByBaseline(const RobotTransferSetup& setup,
                                 const RobotTransferOptions& options, RobotBaseline baseline);

}  // namespace holdfast
