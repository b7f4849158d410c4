// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "solver/robot/transfer_to_robot.h"

namespace holdfast {

/// Ways to transfer that others published, written here from their papers for comparison.
enum class RobotBaseline {
  /// Fingertip vectors (DexPilot, Handa et al. 2020, eq. 1-4, its weights and distances; vectors
  /// scaled by the ratio of finger lengths), the palm laid on the human's.
  kFingertipVectors,
  /// Inverse kinematics of fingertips and wrist, as users of Mink set it up.
  kKeypoints,
  /// Laplacian of an interaction mesh of 21 places of the hand and 60 of the object, nothing in the
  /// object (OmniRetarget, Yang et al. 2025). Edges: the Gabriel graph, those of the Delaunay mesh
  /// whose own ball is empty. Its constraints are walls here.
  kLaplacian,
};

std::string_view BaselineName(RobotBaseline baseline);

/// Frame by frame from the first, each from the frame before.
RobotTransfer TransferByBaseline(const RobotTransferSetup& setup,
                                 const RobotTransferOptions& options, RobotBaseline baseline);

}  // namespace holdfast
