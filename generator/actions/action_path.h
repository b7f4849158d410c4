// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace holdfast {

/// Frame that a pose is relative to and moves with.
enum class Anchor {
  kWorld,  ///< the person starts at the origin, facing -y; z up
  kHead,   ///< head joint: y up, z forward
};

/// A pose that a hand reaches and holds.
struct PathKey {
  double arrive_s = 0.0, leave_s = 0.0;
  Anchor anchor = Anchor::kWorld;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< of the wrist, relative to the anchor
  Eigen::Vector3d bulge = Eigen::Vector3d::Zero();  ///< of the path to the pose, at its middle, m
};

/// A periodic motion added to the path (strokes, blows, shaking), in the frame of the wrist.
struct Stroke {
  double begin_s = 0.0, end_s = 0.0;  ///< fades in and out within a period
  double period_s = 0.5;
  Eigen::Vector3d move = Eigen::Vector3d::Zero();   ///< amplitude, meters
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();   ///< amplitude, axis-angle, radians
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();  ///< fixed point of the rotation
  /// Amplitude of a second translation, delayed by a quarter of a period (for circles), meters.
  Eigen::Vector3d move_aside = Eigen::Vector3d::Zero();
};

/// Target pose of a wrist at one time, in the form used by terms over an unknown head pose:
///
///   position = (1 - share) world + share (h + A head),  rotation likewise by the shortest arc
///
/// where h and A are position and rotation of the head joint.
struct PathPoint {
  double share = 0.0;  ///< weight of the head-relative pose
  Eigen::Isometry3d world = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d head = Eigen::Isometry3d::Identity();

  Eigen::Isometry3d At(const Eigen::Isometry3d& head_pose) const;
};

/// Path of a hand through its keys: minimum jerk between consecutive keys, at rest at each key.
class ActionPath {
 public:
  /// Keys are in order of time. Throws Error if there are none or if times decrease.
  ActionPath(std::vector<PathKey> keys, std::vector<Stroke> strokes);

  PathPoint At(double time_s) const;

 private:
  Eigen::Isometry3d StrokeAt(double time_s) const;

  std::vector<PathKey> keys_;
  std::vector<Stroke> strokes_;
};

}  // namespace holdfast
