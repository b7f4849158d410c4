// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/clip/clip_scene.h"
#include "geometry/render/image.h"
#include "solver/robot/transfer_to_robot.h"

namespace holdfast {

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
