// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// Positions of all joints in one frame, world meters.
using JointPositions = Eigen::Matrix<double, 3, kNumJoints>;

/// Joint positions of every frame of a clip, for a body with these rest joints (3 x 55).
std::vector<JointPositions> JointTrajectory(const Clip& clip, const Eigen::Matrix3Xd& rest_joints);

/// Mean and maximum over the 22 body joints and all frames where the difference is defined.
struct MeanAndMax {
  double mean = 0.0;
  double max = 0.0;
};

struct MotionMetrics {
  /// Central differences of positions; the first and last frames are excluded.
  MeanAndMax joint_acceleration_m_s2;
  MeanAndMax joint_jerk_m_s3;
  /// Mean over frames and both feet of v (2 - 2^(h / 25 mm)) where h < 25 mm. v is the horizontal
  /// displacement of the ball of the foot per frame, h its height above its lowest position in the
  /// clip (Zhang, Starke, Komura & Saito 2018).
  double foot_skate_mm_per_frame = 0.0;
  /// Maximum horizontal displacement of a ball of the foot between two frames with h < 5 mm.
  double foot_slide_max_mm_per_frame = 0.0;
};

/// Throws Error if there are no frames or the frame rate is not positive. A difference for which
/// the clip is too short is zero.
MotionMetrics MeasureMotion(std::span<const JointPositions> frames, double frame_rate_hz);

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
