// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// The 21 points that hand pose is compared by: wrist, 15 finger joints in file order (index,
/// middle, pinky, ring, thumb), 5 fingertips in the same order.
using HandPoints = Eigen::Matrix<double, 3, 21>;

/// One frame of a body: 22 body joints and both hands, world meters.
struct BodyPoints {
  Eigen::Matrix<double, 3, kNumBodyJoints> joints;
  HandPoints right, left;
};

/// Vertices of the fingertips (index, middle, pinky, ring, thumb): SMPL-X has no joint there. Each
/// is the vertex that follows the last phalanx most and lies farthest along it at rest.
std::array<int, 5> FingertipVertices(const BodyModel& model, Side side);

/// Points of every frame of a clip, for a person of this body model and shape.
std::vector<BodyPoints> BodyTrajectory(const Clip& clip,
                                       const std::shared_ptr<const BodyModel>& model,
                                       const Eigen::VectorXd& betas);

/// Mean distances of corresponding points in one frame, mm.
struct JointError {
  double global = 0.0;        ///< of the 22 body joints, in the world (MPJPE)
  double root_aligned = 0.0;  ///< the same with both pelves in one place; rotations as they are
  double right_hand = 0.0;    ///< of the 21 points with both wrists in one place
  double left_hand = 0.0;
};

JointError CompareJoints(const BodyPoints& points, const BodyPoints& reference);

}  // namespace holdfast
