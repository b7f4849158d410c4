// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/matching/foot_lock.h"

namespace holdfast {

/// Fractions of an adult's mass by joint: segment masses and centers of mass of de Leva (1996,
/// table 4), means of women and men, each divided between the joints at the segment's ends. The
/// neck's is negative because the center of the head is above joint 15.
inline constexpr std::array<double, kNumBodyJoints> kJointMasses = {
    0.118,                    // pelvis
    0.0885, 0.0885, 0.0,      // hips, spine1
    0.0823, 0.0823, 0.155,    // knees, spine2
    0.0267, 0.0267, 0.157,    // ankles, spine3
    0.0065, 0.0065, -0.0544,  // balls of the feet, neck
    0.0,    0.0,    0.1224,   // collars, head
    0.0109, 0.0109, 0.0232,   // shoulders, left elbow
    0.0232, 0.0129, 0.0129};  // right elbow, wrists

/// Center of mass, world, meters.
Eigen::Vector3d CenterOfMass(const BodyPlacement& placed);

/// The area over which a body is in balance, seen from above: the convex hull of the heels and
/// balls of the feet on the ground (at most 4 cm above the lowest of them), widened by
/// kFootRadius_m for the width of a foot and the toes.
class FootSupport {
 public:
  static constexpr double kFootRadius_m = 0.05;

  explicit FootSupport(const Soles& soles);

  /// The nearest point of the hull (not widened) to a point on the ground; the point itself inside.
  Eigen::Vector2d Nearest(const Eigen::Vector2d& point) const;
  /// Distance of a point on the ground to the widened area, meters; 0 inside.
  double Outside(const Eigen::Vector2d& point) const;

 private:
  std::vector<Eigen::Vector2d> points_;
};

/// A body whose center of mass is farther outside of its FootSupport, meters, is off balance.
inline constexpr double kOffBalance_m = 0.03;

/// Returns, per frame, whether the pelvis moves at less than 0.1 m/s along the ground, over a third
/// of a second on either side (less at the ends of the motion).
std::vector<bool> StandsStill(std::span<const BodyFrame> frames, double frame_rate);

/// Returns, per frame, how far the center of mass of a body that stands still is outside of its
/// FootSupport, meters. NaN where it moves (StandsStill), sits or lies: the pelvis is below 0.6 of
/// its height when standing.
std::vector<double> OffBalance(std::span<const BodyFrame> frames,
                               const Eigen::Matrix3Xd& rest_joints, double sole_y,
                               double frame_rate);

}  // namespace holdfast
