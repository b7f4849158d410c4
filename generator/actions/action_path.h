// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace holdfast {

/// What a pose is relative to: it goes where that goes.
enum class Anchor {
  kWorld,  ///< the person starts at the origin, facing -y; z up
  kHead,   ///< the head joint: y up, z where the face looks
};

/// A pose that a hand comes to and stays at.
struct PathKey {
  double arrive_s = 0.0, leave_s = 0.0;
  Anchor anchor = Anchor::kWorld;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< of the wrist, relative to the anchor
  Eigen::Vector3d bulge = Eigen::Vector3d::Zero();  ///< of the way there, at its middle, world, m
};

/// A rhythm on top of the path: strokes, blows, shaking. In the wrist's own frame.
struct Stroke {
  double begin_s = 0.0, end_s = 0.0;  ///< fades in and out within a period
  double period_s = 0.5;
  Eigen::Vector3d move = Eigen::Vector3d::Zero();   ///< amplitude, meters
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();   ///< amplitude, axis-angle, radians
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();  ///< that the turn leaves where it is
  /// Moved a quarter of a period later, for circles; meters.
  Eigen::Vector3d move_aside = Eigen::Vector3d::Zero();
};

/// Where a wrist is wanted at a time, as terms over an unknown head pose take it:
///
///   position = (1 - share) world + share (h + A head),  rotation by the shortest arc alike
///
/// h, A: position and rotation of the head joint.
struct PathPoint {
  double share = 0.0;  ///< of the head's
  Eigen::Isometry3d world = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d head = Eigen::Isometry3d::Identity();

  Eigen::Isometry3d At(const Eigen::Isometry3d& head_pose) const;
};

/// The way of a hand through its keys: minimum jerk from each to the next, at rest in all.
class ActionPath {
 public:
  /// Keys in the order of time. Throws Error for none, or times that go back.
  ActionPath(std::vector<PathKey> keys, std::vector<Stroke> strokes);

  PathPoint At(double time_s) const;
  const std::vector<PathKey>& Keys() const { return keys_; }

 private:
  Eigen::Isometry3d StrokeAt(double time_s) const;

  std::vector<PathKey> keys_;
  std::vector<Stroke> strokes_;
};

}  // namespace holdfast
