// SPDX-License-Identifier: MIT
#include "solver/hand_approach.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace holdfast {
namespace {

constexpr int kDirections = 96;
constexpr std::array<double, 4> kOpennesses = {0.3, 0.5, 0.7, 0.9};
constexpr std::array<double, 6> kOnTheWay = {0.006, 0.015, 0.028, 0.045, 0.065, 0.09};  // metres
constexpr std::array<double, 4> kClosing = {0.25, 0.5, 0.75, 0.9};

struct Depths {
  double through = 0.0, below = 0.0;  // metres
};

// Of skin (3 x n, object frame) moved by `shift`.
void Add(const Eigen::Matrix3Xd& skin, const Eigen::Vector3d& shift, const DistanceGrid& object,
         double bottom_z, Depths& depths) {
  for (Eigen::Index i = 0; i < skin.cols(); ++i) {
    const Eigen::Vector3d p = skin.col(i) + shift;
    depths.below = std::max(depths.below, bottom_z - p.z());
    if ((p.array() < object.Min().array()).any() || (p.array() > object.Max().array()).any()) {
      continue;
    }
    depths.through = std::max(depths.through, -object.Distance(p));
  }
}

// Directions evenly over a sphere (a Fibonacci lattice).
Eigen::Vector3d Direction(int k) {
  const double z = 1.0 - (2.0 * k + 1.0) / kDirections;
  const double turn = 2.0 * std::numbers::pi * k / std::numbers::phi;
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(turn), r * std::sin(turn), z};
}

}  // namespace

FingerPose ClosingFingers(const HandApproach& approach, const Grasp& grasp, double share) {
  // Axis-angles are linear in the joints' anatomical angles: this is a straight way in those.
  return approach.ready + share * (grasp.fingers - approach.ready);
}

HandApproach FindApproach(const HandAnatomy& anatomy, const Grasp& grasp,
                          const DistanceGrid& object, double bottom_z) {
  HandEvaluation hand = AtWrist(anatomy.hand);
  const Eigen::Isometry3d object_from_wrist = grasp.wrist_from_object.inverse();
  const FingerPose open = anatomy.axes.PoseOf(OpenHand(anatomy.axes));
  const auto skin_of = [&](const FingerPose& fingers) -> Eigen::Matrix3Xd {
    return object_from_wrist * hand.At(fingers.data(), false).Vertices();
  };
  Depths own;
  Add(skin_of(grasp.fingers), Eigen::Vector3d::Zero(), object, bottom_z, own);
  const Eigen::Vector3d usual =
      -(object_from_wrist.linear() * (anatomy.axes.Forward() + anatomy.axes.PalmNormal()))
           .normalized();

  HandApproach best;
  double least = std::numeric_limits<double>::infinity();
  for (const double openness : kOpennesses) {
    HandApproach tried;
    tried.openness = openness;
    tried.ready = grasp.fingers + openness * (open - grasp.fingers);
    Depths closing;
    for (const double share : kClosing) {
      Add(skin_of(ClosingFingers(tried, grasp, share)), Eigen::Vector3d::Zero(), object, bottom_z,
          closing);
    }
    const Eigen::Matrix3Xd ready = skin_of(tried.ready);
    Add(ready, Eigen::Vector3d::Zero(), object, bottom_z, closing);
    for (int k = 0; k < kDirections; ++k) {
      tried.retreat = Direction(k);
      Depths depths = closing;
      for (const double r : kOnTheWay) Add(ready, r * tried.retreat, object, bottom_z, depths);
      tried.through_mm = 1000.0 * std::max(0.0, depths.through - own.through);
      tried.below_mm = 1000.0 * depths.below;
      const double cost = tried.through_mm + 0.5 * tried.below_mm +
                          3.0 * (1.0 - tried.retreat.dot(usual)) + 3.0 * std::abs(openness - 0.6);
      if (cost < least) {
        least = cost;
        best = tried;
      }
    }
  }
  return best;
}

}  // namespace holdfast
