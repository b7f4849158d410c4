// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/mesh/distance_grid.h"
#include "solver/hand/hand_postures.h"

namespace holdfast {

/// A hand in one frame of its way to a hold or from it, relative to the object.
struct PassageFrame {
  int t = 0;
  FingerPose fingers = FingerPose::Zero();
  Eigen::Matrix3Xd skin;   ///< SkinPositions, wrist's frame
  Eigen::Matrix4Xd balls;  ///< HandBalls, wrist's frame
  Eigen::Isometry3d object_from_wrist = Eigen::Isometry3d::Identity();  ///< without a retreat
  Eigen::Matrix4Xd other;  ///< the other hand's HandBalls, object's frame; may be empty
  double retreat = 0.0;    ///< metres
};

/// How deep a hand is on its way, beyond what it is in the hold itself, and by how much it has to
/// keep off along a line to be clear. Counted are skin in the object, the object's walls in the
/// hand's balls (a wall thinner than a finger goes through it with no skin inside for more than
/// half its thickness), and skin in the other hand's balls, by half and less 2 mm: hands are soft.
class PassageClearance {
 public:
  /// `held`: the hand in the hold, which begins or ends in that frame. What it is given must
  /// outlive it.
  PassageClearance(const HandAnatomy& anatomy, const DistanceGrid& object, const PassageFrame& held,
                   double frame_rate);

  /// Metres; 0: clear. The hand is moved by `shift`, object's frame, metres.
  double TooDeep(const PassageFrame& frame, const Eigen::Vector3d& shift) const;

  /// Sets the least retreats along `line` (unit, object's frame) that clear all frames, as far as
  /// that is worth it; they come and go smoothly and are 0 in the hold. `frames` go outwards from
  /// the one next to the hold; while the first `opening` open their fingers, they do not give way
  /// because of later ones. Returns what the way costs, metres: retreats, and 30 a metre of depth.
  double Retreat(const Eigen::Vector3d& line, int opening, std::span<PassageFrame> frames) const;

 private:
  double InObject(const PassageFrame& frame, const Eigen::Isometry3d& object_from_wrist) const;
  double OfWalls(const PassageFrame& frame, const Eigen::Isometry3d& object_from_wrist) const;
  double InOther(const PassageFrame& frame, const Eigen::Isometry3d& object_from_wrist) const;
  double LeastRetreat(const PassageFrame& frame, const Eigen::Vector3d& line) const;
  void Smooth(const std::vector<double>& needed, int opening, std::span<PassageFrame> frames) const;

  const HandAnatomy& anatomy_;
  const DistanceGrid& object_;
  int edge_;
  double frame_rate_;
  double in_object_, in_other_;  // of the hold
  Eigen::VectorXd of_walls_;     // of each ball in the hold
};

}  // namespace holdfast
