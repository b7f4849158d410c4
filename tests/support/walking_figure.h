// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

#include "generator/body/pose_builder.h"
#include "generator/matching/motion_library.h"
#include "generator/scripted/reach_motion.h"
#include "geometry/rotation.h"

namespace holdfast::testing {

/// One frame of a figure that stands in the world, facing -y, with these bends of hips and knees.
struct FigurePose {
  double left_hip = 0.0, right_hip = 0.0;  ///< forward, radians
  double left_knee = 0.05, right_knee = 0.05;
  double right_arm = 0.0;  ///< 0 hangs, 1 points forward
  double way_m = 0.0;      ///< along -y
};

/// A clip of stick-figure poses at 30 Hz; the lower foot is on the ground.
template <typename PoseAt>
Clip Figure(const BodyMeasures& body, int frames, const PoseAt& pose_at) {
  const Eigen::Matrix3Xd& rest_joints = body.rest_joints;
  const auto about = [](double angle, const Eigen::Vector3d& axis) {
    return ExpSO3(Eigen::Vector3d(angle * axis));
  };
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), z = Eigen::Vector3d::UnitZ();
  Clip clip;
  clip.body_model = BodyModel::Default()->Name();
  clip.trans.resize(3, frames);
  for (int t = 0; t < frames; ++t) {
    const FigurePose figure = pose_at(t);
    PoseBuilder pose(rest_joints, Eigen::Vector3d::Zero());
    pose.SetLocal(0, about(M_PI / 2, x));
    pose.SetLocal(1, about(-figure.left_hip, x));
    pose.SetLocal(2, about(-figure.right_hip, x));
    pose.SetLocal(4, about(figure.left_knee, x));
    pose.SetLocal(5, about(figure.right_knee, x));
    for (const int ankle : {7, 8}) pose.SetWorld(ankle, about(M_PI / 2, x));
    pose.SetLocal(16, about(-1.3, z));
    const double lift = figure.right_arm * M_PI / 2;
    pose.SetLocal(17, about(-lift, x) * about(1.3, z));
    pose.SetLocal(18, about(-0.3, Eigen::Vector3d::UnitY()));
    pose.SetLocal(19, about(0.3 + figure.right_arm, Eigen::Vector3d::UnitY()));
    const double lowest = std::min(pose.Position(7).z(), pose.Position(8).z());
    pose.SetPelvis({0.0, -figure.way_m, rest_joints(1, 7) - body.sole_y - lowest});
    clip.pose.push_back(pose.Pose(t > 0 ? clip.pose.back() : JointPose::Zero()));
    clip.trans.col(t) = pose.Trans();
  }
  return clip;
}

inline Clip StandingFigure(const BodyMeasures& body, int frames) {
  return Figure(body, frames, [](int) { return FigurePose{}; });
}

/// Legs that swing like a pendulum, one step in half a second, at `speed` m/s.
inline Clip WalkingFigure(const BodyMeasures& body, int frames, double speed) {
  return Figure(body, frames, [speed](int t) {
    const double phase = M_PI * t / 15.0;
    FigurePose pose;
    pose.left_hip = 0.2 * std::asin(std::sin(phase));  // as steady as the ground goes by
    pose.right_hip = -pose.left_hip;
    // The leg that comes forward bends.
    pose.left_knee += 0.9 * std::max(0.0, std::cos(phase));
    pose.right_knee += 0.9 * std::max(0.0, -std::cos(phase));
    pose.way_m = speed * t / 30.0;
    return pose;
  });
}

/// Stands and lifts the right arm forward: highest in the middle.
inline Clip ReachingFigure(const BodyMeasures& body, int frames, double height) {
  return Figure(body, frames, [=](int t) {
    FigurePose pose;
    pose.right_arm = height * std::pow(std::sin(M_PI * t / (frames - 1.0)), 2);
    return pose;
  });
}

/// Somebody who stands, walks and reaches: clips "stand", "walk", "reach_1", "reach_2", each
/// followed by its mirror image.
inline MotionLibrary FigureLibrary(const BodyMeasures& body) {
  MotionLibrary library(body.rest_joints, body.sole_y);
  library.Add(StandingFigure(body, 120), "stand", {true, {}});
  library.Add(WalkingFigure(body, 240, 1.0), "walk", {true, {}});
  library.Add(ReachingFigure(body, 121, 0.7), "reach_1", {false, ReachMark{60}});
  library.Add(ReachingFigure(body, 121, 1.2), "reach_2", {false, ReachMark{60}});
  library.Finish();
  return library;
}

}  // namespace holdfast::testing
