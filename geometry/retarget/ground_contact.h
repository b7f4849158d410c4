// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/skeleton.h"

namespace holdfast {

/// Points of the body that may touch the ground, derived from rest joints alone: heel and ball of
/// each foot on its sole, and the undersides of knees, pelvis, elbows, wrists and head as spheres.
class GroundProbe {
 public:
  /// `floor_y`: ground under the rest pose (y up), meters.
  GroundProbe(const Eigen::Matrix3Xd& rest_joints, double floor_y);

  static constexpr int kNumSoles = 4;  ///< first: left heel, left ball, right heel, right ball

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

/// Estimates the ground from all points at rest (slower than 0.3 m/s): the lowest level with many
/// such points. Robust against airborne frames, stairs and single outliers; if nothing is ever at
/// rest, the 5th percentile of the lowest points. The slope is zero unless `level` is set and the
/// points fit a tilted plane clearly better than a level one (capture volumes may be tilted by a
/// degree). `points`: one (3 x P) of GroundProbe::LowestPoints per frame.
GroundPlane FindGround(const std::vector<Eigen::Matrix3Xd>& points, double frame_rate, bool level);

}  // namespace holdfast
