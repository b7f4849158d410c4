// SPDX-License-Identifier: MIT
#include "solver/hand/hand_axes.h"
#include "geometry/rotation.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace holdfast {
namespace {

// Reference values of active ranges, degrees; distal joints use those of the proximal ones of their
// kind.
constexpr AngleRange kFingerFlexion[3] = {{-25.0, 90.0}, {0.0, 105.0}, {-5.0, 80.0}};
constexpr AngleRange kThumbFlexionRange[3] = {{-20.0, 50.0}, {-10.0, 60.0}, {-15.0, 80.0}};
constexpr AngleRange kThumbSpreadRange[3] = {{-10.0, 50.0}, {-10.0, 10.0}, {0.0, 0.0}};
constexpr double kTwist = 5.0;  // soft tissue; a saddle joint twists more
constexpr double kThumbTwistAngle = 20.0;

Eigen::Vector3d OrthogonalTo(const Eigen::Vector3d& v, const Eigen::Vector3d& unit) {
  return (v - v.dot(unit) * unit).normalized();
}

}  // namespace

int DominantJoint(const BodySurface& surface, int vertex) {
  int joint = -1;
  double most = 0.0;
  for (const auto& [j, w] : surface.Weights(vertex)) {
    if (w > most) {
      most = w;
      joint = j;
    }
  }
  return joint;
}

HandAxes::HandAxes(const HandModel& hand) : side_(hand.HandSide()) {
  const BodySurface& surface = hand.Surface();
  const int first = HandBegin(side_);
  const Eigen::Vector3d wrist = surface.RestJoints().col(WristJoint(side_));
  for (int k = 0; k < kJointsPerHand; ++k) {
    rest_joints_.col(k) = surface.RestJoints().col(first + k) - wrist;
  }

  // Fingertips have no joint: use the vertex of the last phalanx farthest along the finger.
  for (int finger = 0; finger < kNumFingers; ++finger) {
    const Eigen::Vector3d last = rest_joints_.col(3 * finger + 2);
    const Eigen::Vector3d along = (last - rest_joints_.col(3 * finger + 1)).normalized();
    rest_tips_.col(finger) = last + 0.02 * along;
    double farthest = 0.0;
    for (int i = 0; i < hand.NumVertices(); ++i) {
      if (DominantJoint(surface, i) != first + 3 * finger + 2) continue;
      const Eigen::Vector3d x = surface.RestVertices().col(i) - wrist - last;
      if (x.dot(along) > farthest) {
        farthest = x.dot(along);
        rest_tips_.col(finger) = last + x;
      }
    }
  }

  forward_ = rest_joints_.col(3 * kMiddle).normalized();
  across_ = OrthogonalTo(rest_joints_.col(3 * kIndex) - rest_joints_.col(3 * kPinky), forward_);
  palm_normal_ = side_ == Side::kRight ? across_.cross(forward_) : forward_.cross(across_);

  for (int k = 0; k < kJointsPerHand; ++k) {
    const bool thumb = k / 3 == kThumb;
    const Eigen::Vector3d bone = Bone(k);
    // The thumb's pad faces past the palm's center: forward, out of the palm, and away from its own
    // side.
    const Eigen::Vector3d facing =
        thumb ? Eigen::Vector3d(forward_ + palm_normal_ - across_) : palm_normal_;
    const Eigen::Vector3d pad = OrthogonalTo(facing, bone);
    pad_direction_.col(k) = pad;
    const Eigen::Vector3d flexion = bone.cross(pad);
    const Eigen::Vector3d& outwards = thumb ? palm_normal_ : across_;
    const Eigen::Vector3d spread =
        pad.cross(bone).dot(outwards) > 0.0 ? pad : Eigen::Vector3d(-pad);
    axes_[k] << flexion, spread, flexion.cross(spread);

    if (!thumb) {
      const Eigen::Vector3d before =
          k % 3 == 0 ? Eigen::Vector3d(rest_joints_.col(k).normalized()) : Bone(k - 1);
      // As seen along the flexion axis.
      rest_flexion_[k] =
          std::atan2(bone.dot(pad), bone.dot(bone)) - std::atan2(before.dot(pad), before.dot(bone));
    }
    const auto set = [&](int row, AngleRange degrees, double offset) {
      range_[row][k] = {degrees.low * kDegree - offset, degrees.high * kDegree - offset};
    };
    if (thumb) {
      set(0, kThumbFlexionRange[k % 3], 0.0);
      set(1, kThumbSpreadRange[k % 3], 0.0);
      const double twist = k % 3 == 0 ? kThumbTwistAngle : kTwist;
      set(2, {-twist, twist}, 0.0);
    } else {
      set(0, kFingerFlexion[k % 3], rest_flexion_[k]);
      // The rest pose itself is always within the range.
      range_[0][k].low = std::min(range_[0][k].low, 0.0);
      const bool edge = k / 3 == kIndex || k / 3 == kPinky;
      const double spread_range = k % 3 != 0 ? 0.0 : edge ? 20.0 : 15.0;
      set(1, {-spread_range, spread_range}, 0.0);
      set(2, {-kTwist, kTwist}, 0.0);
    }
  }
}

Eigen::Vector3d HandAxes::Bone(int k) const {
  const Eigen::Vector3d end =
      k % 3 == 2 ? Eigen::Vector3d(rest_tips_.col(k / 3)) : rest_joints_.col(k + 1);
  return (end - rest_joints_.col(k)).normalized();
}

FingerPose HandAxes::PoseOf(const HandAngles& angles) const {
  FingerPose pose;
  for (int k = 0; k < kJointsPerHand; ++k) pose.segment<3>(3 * k) = axes_[k] * angles.col(k);
  return pose;
}

HandAngles HandAxes::AnglesOf(const FingerPose& pose) const {
  HandAngles angles;
  for (int k = 0; k < kJointsPerHand; ++k) {
    angles.col(k) = axes_[k].transpose() * pose.segment<3>(3 * k);
  }
  return angles;
}

HandAngles HandAxes::Clamp(const HandAngles& angles) const {
  HandAngles clamped;
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < kJointsPerHand; ++k) {
      clamped(row, k) = std::clamp(angles(row, k), range_[row][k].low, range_[row][k].high);
    }
  }
  return clamped;
}

double HandAxes::LimitExcess(const HandAngles& angles) const {
  return (angles - Clamp(angles)).cwiseAbs().maxCoeff();
}

HandAngles HandAxes::Relaxed() const {
  HandAngles angles = HandAngles::Zero();
  for (int finger = 0; finger < kNumFingers; ++finger) {
    if (finger == kThumb) continue;
    // A slight curl that increases towards the little finger.
    const double more = finger == kIndex    ? 0.0
                        : finger == kMiddle ? 4.0
                        : finger == kRing   ? 8.0
                                            : 10.0;
    const double flexion[3] = {15.0 + more, 25.0 + more, 14.0 + 0.5 * more};
    for (int j = 0; j < 3; ++j) {
      angles(0, 3 * finger + j) = flexion[j] * kDegree - rest_flexion_[3 * finger + j];
    }
  }
  angles(0, 3 * kThumb + 1) = 8.0 * kDegree;
  angles(0, 3 * kThumb + 2) = 12.0 * kDegree;
  return Clamp(angles);
}

}  // namespace holdfast
