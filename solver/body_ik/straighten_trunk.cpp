// SPDX-License-Identifier: MIT
#include "solver/body_ik/straighten_trunk.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "generator/matching/foot_lock.h"
#include "generator/walk_statistics/reach_faults.h"
#include "geometry/rotation.h"
#include "solver/body_ik/envelope.h"

namespace holdfast {
namespace {

constexpr double kFree = 3.0 * kDegree, kMost = 20.0 * kDegree;
constexpr double kStands = 60.0 * kDegree;  // who leans farther back lies
constexpr int kEven = 8;                    // frames
constexpr std::array<int, 3> kSpine = {kSpine1, kSpine2, kSpine3};
constexpr std::array<double, 3> kShares = {0.4, 0.35, 0.25};

// Bends the trunk forward so that pelvis to neck turns by `angle`.
void BendForward(const BodyPlacement& placed, double yaw, double angle, BodyFrame& frame) {
  const double height = placed.joints(2, kNeck) - placed.joints(2, kPelvis);
  double moved = 0.0;
  for (std::size_t k = 0; k < kSpine.size(); ++k) {
    moved += kShares[k] * (placed.joints(2, kNeck) - placed.joints(2, kSpine[k])) / height;
  }
  const Eigen::Vector3d left(std::cos(yaw), std::sin(yaw), 0.0);
  const auto turn = [&](int joint, double by) {
    const Eigen::Matrix3d& parent = placed.rotation[kJointParents[joint]];
    const Eigen::Matrix3d turned =
        Eigen::AngleAxisd(by, left) * placed.rotation[static_cast<std::size_t>(joint)];
    frame.local[static_cast<std::size_t>(joint)] =
        Eigen::Quaterniond(Eigen::Matrix3d(parent.transpose() * turned)).normalized();
  };
  for (std::size_t k = 0; k < kSpine.size(); ++k) turn(kSpine[k], kShares[k] * angle / moved);
  turn(kNeck, -angle / moved);
}

}  // namespace

void StraightenTrunk(const Eigen::Matrix3Xd& rest_joints, std::vector<BodyFrame>& frames) {
  const std::vector<BodyPlacement> placed = Place(rest_joints, frames);
  std::vector<double> beyond;
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const double lean = LeanBack(placed[t], Yaw(frames[t]));
    beyond.push_back(lean < kStands ? std::clamp(lean - kFree, 0.0, kMost) : 0.0);
  }
  const std::vector<double> bends = Envelope(beyond, kEven);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const double bend = FadeIn(static_cast<int>(t)) * bends[t];
    if (bend > 0.0) BendForward(placed[t], Yaw(frames[t]), bend, frames[t]);
  }
}

}  // namespace holdfast
