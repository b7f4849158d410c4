// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// The 21 points of a hand used in comparisons: wrist, 15 finger joints in file order (index,
/// middle, pinky, ring, thumb), 5 fingertips in the same order.
using HandPoints = Eigen::Matrix<double, 3, 21>;

/// Points of a body in one frame: 22 body joints and both hands, world meters.
struct BodyPoints {
  Eigen::Matrix<double, 3, kNumBodyJoints> joints;
  HandPoints right, left;
};

/// Returns the fingertip vertices (index, middle, pinky, ring, thumb), since SMPL-X has no joints
/// there: among the vertices that follow the last phalanx most, the farthest along it at rest.
std::array<int, 5> FingertipVertices(const BodyModel& model, Side side);

/// Returns the points of every frame of a clip for a person with this body model and shape.
std::vector<BodyPoints> BodyTrajectory(const Clip& clip,
                                       const std::shared_ptr<const BodyModel>& model,
                                       const Eigen::VectorXd& betas);

/// Mean distances of corresponding points in one frame, mm.
struct JointError {
  double global = 0.0;        ///< MPJPE of the 22 body joints in the world
  double root_aligned = 0.0;  ///< same with the pelves aligned in position, not in rotation
  double right_hand = 0.0;    ///< mean of the 21 points with the wrists aligned in position
  double left_hand = 0.0;
};

JointError CompareJoints(const BodyPoints& points, const BodyPoints& reference);

}  // namespace holdfast
