// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/skeleton.h"

namespace holdfast {

/// Points of the body that may touch the ground, found from rest joints alone: heel and ball of
/// each foot on its sole, and the undersides of knees, pelvis, elbows, wrists and head as spheres.
class GroundProbe {
 public:
  /// `floor_y`: ground under the rest pose (y up), meters.
  GroundProbe(const Eigen::Matrix3Xd& rest_joints, double floor_y);

  static constexpr int kNumSoles = 4;  ///< left heel, left ball, right heel, right ball come first

  /// Lowest points (3 x P), world z-up, of a body with these joint positions and world rotations.
  Eigen::Matrix3Xd LowestPoints(const Eigen::Matrix<double, 3, kNumJoints>& joints,
                                const std::array<Eigen::Matrix3d, kNumJoints>& rotations) const;

 private:
  struct Point {
    int joint;
    Eigen::Vector3d offset;  // in the joint's frame
    double radius;
  };
  std::vector<Point> points_;
};

/// The ground under a motion: z = height + slope . (x, y).
struct GroundPlane {
  double height = 0;                                ///< meters
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< rise per meter along x and y
};

/// The ground, from all points that stand still (slower than 0.3 m/s): the lowest level where many
/// do. Robust against frames in the air, stairs and single outliers; with nothing ever at rest, the
/// 5th percentile of the lowest points. Where `level` is set and the points lie on a plane clearly
/// better than on a level, its slope (capture volumes are tilted by a degree at times), else zero.
/// `points`: one (3 x P) of GroundProbe::LowestPoints per frame.
GroundPlane FindGround(const std::vector<Eigen::Matrix3Xd>& points, double frame_rate, bool level);

}  // namespace holdfast
