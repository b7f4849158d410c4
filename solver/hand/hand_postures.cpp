// SPDX-License-Identifier: MIT
#include "solver/hand/hand_postures.h"
#include "geometry/rotation.h"

#include <algorithm>
#include <array>

#include <ceres/ceres.h>

namespace holdfast {
namespace {

// The rest pose is fanned out; fingers about to close are nearly parallel (degrees).
constexpr double kFan[kNumFingers] = {-3.0, 0.0, 7.0, 3.0, 0.0};

// Parameters of a pinch: all fingers bend alike.
enum Pinch {
  kRoot,
  kMiddleJoint,
  kThumbFlexion,
  kThumbAbduction,
  kThumbSecond,
  kThumbLast,
  kNumPinch
};

HandAngles PinchAngles(const HandAxes& axes, const double* x) {
  HandAngles angles = HandAngles::Zero();
  for (int finger = 0; finger < kNumFingers; ++finger) {
    if (finger == kThumb) continue;
    // Fingers beyond the middle one close slightly more, as they are shorter.
    const double more = finger == kRing ? 4.0 * kDegree : finger == kPinky ? 8.0 * kDegree : 0.0;
    angles(0, 3 * finger) = x[kRoot] + more - axes.RestFlexion(3 * finger);
    angles(0, 3 * finger + 1) = x[kMiddleJoint] + more - axes.RestFlexion(3 * finger + 1);
    angles(0, 3 * finger + 2) =
        2.0 / 3.0 * (x[kMiddleJoint] + more) - axes.RestFlexion(3 * finger + 2);
    angles(1, 3 * finger) = kFan[finger] * kDegree;
  }
  angles(0, 3 * kThumb) = x[kThumbFlexion];
  angles(1, 3 * kThumb) = x[kThumbAbduction];
  angles(0, 3 * kThumb + 1) = x[kThumbSecond];
  angles(0, 3 * kThumb + 2) = x[kThumbLast];
  return angles;
}

struct PinchResidual {
  const HandAnatomy& anatomy;
  HandEvaluation& hand;
  double width;
  std::array<double, kNumPinch> preferred;

  static constexpr int kNumResiduals = 7 + 2 * kNumPinch;

  bool operator()(const double* x, double* residuals) const {
    const HandAngles angles = PinchAngles(anatomy.axes, x);
    const FingerPose pose = anatomy.axes.PoseOf(angles);
    const HandState& state = hand.At(pose.data(), false);
    const auto pad = [&](int finger) -> Eigen::Vector3d {
      return state.Vertices().col(anatomy.landmarks.PadCenter(finger));
    };
    const auto facing = [&](int finger) -> Eigen::Vector3d {
      return state.JointRotation(3 * finger + 2) * anatomy.axes.PadDirection(3 * finger + 2);
    };
    const Eigen::Vector3d apart = 0.5 * (pad(kIndex) + pad(kMiddle)) - pad(kThumb);
    const double distance = std::max(apart.norm(), 1e-6);
    const Eigen::Vector3d direction = apart / distance;
    residuals[0] = 100.0 * (distance - width);
    Eigen::Map<Eigen::Vector3d>(residuals + 1) = 0.5 * (facing(kThumb) - direction);
    Eigen::Map<Eigen::Vector3d>(residuals + 4) =
        0.5 * (0.5 * (facing(kIndex) + facing(kMiddle)) + direction);
    for (int i = 0; i < kNumPinch; ++i) residuals[7 + i] = 0.15 * (x[i] - preferred[i]);
    const HandAngles excess = angles - anatomy.axes.Clamp(angles);
    residuals[7 + kNumPinch + 0] = 5.0 * excess(0, 3 * kMiddle);
    residuals[7 + kNumPinch + 1] = 5.0 * excess(0, 3 * kMiddle + 1);
    residuals[7 + kNumPinch + 2] = 5.0 * excess(0, 3 * kThumb);
    residuals[7 + kNumPinch + 3] = 5.0 * excess(1, 3 * kThumb);
    residuals[7 + kNumPinch + 4] = 5.0 * excess(0, 3 * kThumb + 1);
    residuals[7 + kNumPinch + 5] = 5.0 * excess(0, 3 * kThumb + 2);
    return true;
  }
};

}  // namespace

HandEvaluation AtWrist(const HandModel& hand) {
  return HandEvaluation(hand, JointPose::Zero(),
                        -hand.Surface().RestJoints().col(WristJoint(hand.HandSide())));
}

HandAngles OpenHand(const HandAxes& axes) {
  HandAngles angles = HandAngles::Zero();
  for (int finger = 0; finger < kNumFingers; ++finger) {
    if (finger == kThumb) continue;
    for (int j = 0; j < 3; ++j) {
      angles(0, 3 * finger + j) = -axes.RestFlexion(3 * finger + j);
    }
    angles(1, 3 * finger) = kFan[finger] * kDegree;
  }
  angles(0, 3 * kThumb) = -15.0 * kDegree;
  angles(1, 3 * kThumb) = 25.0 * kDegree;
  return axes.Clamp(angles);
}

HandAngles PinchHand(const HandAnatomy& anatomy, double width) {
  HandEvaluation hand = AtWrist(anatomy.hand);
  const std::array<double, kNumPinch> preferred = {45.0 * kDegree, 35.0 * kDegree, 15.0 * kDegree,
                                                   20.0 * kDegree, 10.0 * kDegree, 15.0 * kDegree};
  std::array<double, kNumPinch> x = preferred;
  ceres::Problem problem;
  problem.AddResidualBlock(
      new ceres::NumericDiffCostFunction<PinchResidual, ceres::CENTRAL,
                                         PinchResidual::kNumResiduals, kNumPinch>(
          new PinchResidual{anatomy, hand, width, preferred}),
      nullptr, x.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 40;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return anatomy.axes.Clamp(PinchAngles(anatomy.axes, x.data()));
}

}  // namespace holdfast
