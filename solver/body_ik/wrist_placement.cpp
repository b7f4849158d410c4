// SPDX-License-Identifier: MIT
#include "solver/body_ik/wrist_placement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

#include "generator/body/limb_ik.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

// Of a joint that turns about all three axes: its share of the work.
struct Turning {
  int joint;
  double weight;
};

double Bend(const BodyPlacement& at, const Limb& arm) {
  const Vector3d upper = at.joints.col(arm.middle) - at.joints.col(arm.root);
  const Vector3d lower = at.joints.col(arm.end) - at.joints.col(arm.middle);
  return std::atan2(upper.cross(lower).norm(), upper.dot(lower));
}

}  // namespace

double PlaceWrist(const Eigen::Matrix3Xd& rest_joints, Side side, const Vector3d& target,
                  BodyFrame& frame) {
  const Limb arm = Arm(side);
  const std::array<Turning, 5> turning = {{{kSpine1, 0.05},
                                           {kSpine2, 0.05},
                                           {kSpine3, 0.08},
                                           {kJointParents[arm.root], 0.15},
                                           {arm.root, 1.0}}};
  constexpr double kElbowWeight = 1.5;
  constexpr int kIterations = 6;
  constexpr double kDamping = 2e-3;      // m^2: of a step that would have to be long
  constexpr double kLongestStep = 0.35;  // radians, of any angle
  constexpr double kLeastBend = 3.0 * kDegree, kMostBend = 150.0 * kDegree;
  constexpr int kAngles = 16;
  double missed = 0.0;
  for (int iteration = 0;; ++iteration) {
    const BodyPlacement at = Place(rest_joints, frame);
    const Vector3d wrist = at.joints.col(arm.end);
    const Vector3d lacks = target - wrist;
    missed = lacks.norm();
    if (iteration == kIterations || missed < 1e-4) return missed;
    Eigen::Matrix<double, 3, kAngles> J;
    Eigen::Matrix<double, kAngles, 1> weight;
    int column = 0;
    for (const Turning& turn : turning) {
      const Vector3d way = wrist - at.joints.col(turn.joint);
      for (int axis = 0; axis < 3; ++axis, ++column) {
        J.col(column) = at.rotation[turn.joint].col(axis).cross(way);
        weight[column] = turn.weight;
      }
    }
    J.col(column) =
        (at.rotation[arm.middle] * arm.hinge).cross(Vector3d(wrist - at.joints.col(arm.middle)));
    weight[column] = kElbowWeight;
    Eigen::Matrix3d normal = J * weight.asDiagonal() * J.transpose();
    normal.diagonal().array() += kDamping;
    Eigen::Matrix<double, kAngles, 1> step =
        weight.asDiagonal() * (J.transpose() * normal.ldlt().solve(lacks));
    const double longest = step.cwiseAbs().maxCoeff();
    if (longest > kLongestStep) step *= kLongestStep / longest;
    const double bend = Bend(at, arm);
    step[column] = std::clamp(step[column], kLeastBend - bend, kMostBend - bend);
    column = 0;
    for (const Turning& turn : turning) {
      frame.local[turn.joint] =
          (frame.local[turn.joint] * Eigen::Quaterniond(ExpSO3(step.segment<3>(column))))
              .normalized();
      column += 3;
    }
    frame.local[arm.middle] =
        (frame.local[arm.middle] * Eigen::Quaterniond(ExpSO3(Vector3d(step[column] * arm.hinge))))
            .normalized();
  }
}

}  // namespace holdfast
