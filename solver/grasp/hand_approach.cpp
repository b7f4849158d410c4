// SPDX-License-Identifier: MIT
#include "solver/grasp/hand_approach.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace holdfast {
namespace {

constexpr int kApproachDirections = 96;
constexpr std::array<double, 6> kOpennesses = {0.5, 0.7, 0.3, 0.9, 0.2, 0.1};
constexpr std::array<double, 4> kLeads = {0.0, 0.5, 1.0, -0.5};
constexpr std::array<double, 6> kOnTheWay = {0.006, 0.015, 0.028, 0.045, 0.065, 0.09};  // meters
constexpr std::array<double, 8> kClosing = {0.1, 0.22, 0.35, 0.48, 0.6, 0.72, 0.85, 0.95};

constexpr double kCostRounding = 1e-9;

struct Depths {
  double through = 0.0, below = 0.0;  // meters
  // Maximum number of skin points inside at once. A wall is no deeper than half its thickness, so
  // passing through it shows in the number of points inside.
  int inside = 0;
};

// Adds the depths of skin (3 x n, object frame) moved by `shift`.
void Add(const Eigen::Matrix3Xd& skin, const Eigen::Vector3d& shift, const DistanceGrid& object,
         double bottom_z, Depths& depths) {
  constexpr double kTouch = 0.0007;
  int inside = 0;
  for (Eigen::Index i = 0; i < skin.cols(); ++i) {
    const Eigen::Vector3d p = skin.col(i) + shift;
    depths.below = std::max(depths.below, bottom_z - p.z());
    if ((p.array() < object.Min().array()).any() || (p.array() > object.Max().array()).any()) {
      continue;
    }
    if (object.Linear(p) > 2.0 * object.CellSize()) continue;  // well outside
    const double depth = -object.Distance(p);
    depths.through = std::max(depths.through, depth);
    inside += depth > kTouch;
  }
  depths.inside = std::max(depths.inside, inside);
}

// Directions distributed evenly over a sphere (Fibonacci lattice).
Eigen::Vector3d Direction(int k) {
  const double z = 1.0 - (2.0 * k + 1.0) / kApproachDirections;
  const double turn = 2.0 * std::numbers::pi * k / std::numbers::phi;
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(turn), r * std::sin(turn), z};
}

}  // namespace

FingerPose ClosingFingers(const HandApproach& approach, const Grasp& grasp, double share) {
  const double lead = std::abs(approach.tips_lead);
  FingerPose fingers = approach.ready;
  for (int joint = 0; joint < kJointsPerHand; ++joint) {
    const int from_tip = approach.tips_lead > 0.0 ? 2 - joint % 3 : joint % 3;
    const double own = std::clamp(share * (1.0 + lead) - 0.5 * lead * from_tip, 0.0, 1.0);
    // Axis-angles are linear in the joint's anatomical angles, so this is a straight line in them.
    fingers.segment<3>(3 * joint) += own * (grasp.fingers - approach.ready).segment<3>(3 * joint);
  }
  return fingers;
}

HandApproach FindApproach(const HandAnatomy& anatomy, const Grasp& grasp,
                          const DistanceGrid& object, double bottom_z) {
  HandEvaluation hand = AtWrist(anatomy.hand);
  const Eigen::Isometry3d object_from_wrist = grasp.wrist_from_object.inverse();
  const FingerPose open = anatomy.axes.PoseOf(OpenHand(anatomy.axes));
  const auto skin_of = [&](const FingerPose& fingers) -> Eigen::Matrix3Xd {
    // Includes edge midpoints: a handle's bar is thinner than the vertex spacing.
    Eigen::Matrix3Xd skin;
    SkinPositions(anatomy.landmarks, hand.At(fingers).Vertices(), skin);
    return object_from_wrist * skin;
  };
  Depths own;
  Add(skin_of(grasp.fingers), Eigen::Vector3d::Zero(), object, bottom_z, own);
  const Eigen::Vector3d usual =
      -(object_from_wrist.linear() * (anatomy.axes.Forward() + anatomy.axes.PalmNormal()))
           .normalized();

  HandApproach best;
  double least = std::numeric_limits<double>::infinity();
  const auto cost_of = [&](HandApproach& tried, const Depths& depths) {
    tried.through_mm = 1000.0 * std::max(0.0, depths.through - own.through);
    tried.below_mm = 1000.0 * depths.below;
    return tried.through_mm + 0.2 * depths.inside + 0.5 * tried.below_mm +
           3.0 * std::abs(tried.openness - 0.6) + std::abs(tried.tips_lead);
  };
  for (const double openness : kOpennesses) {
    HandApproach tried;
    tried.openness = openness;
    tried.ready = grasp.fingers + openness * (open - grasp.fingers);
    const Eigen::Matrix3Xd ready = skin_of(tried.ready);
    Depths at_rest;
    Add(ready, Eigen::Vector3d::Zero(), object, bottom_z, at_rest);
    // The closing of the fingers does not depend on the approach direction.
    Depths closing;
    double least_closing = std::numeric_limits<double>::infinity();
    for (const double lead : kLeads) {
      HandApproach way = tried;
      way.tips_lead = lead;
      Depths depths = at_rest;
      for (const double share : kClosing) {
        // The cost only grows: neither the best closing of these fingers nor the best of all.
        if (const double cost = cost_of(way, depths);
            cost >= least_closing || cost >= least + kCostRounding) {
          break;
        }
        Add(skin_of(ClosingFingers(way, grasp, share)), Eigen::Vector3d::Zero(), object, bottom_z,
            depths);
      }
      const double cost = cost_of(way, depths);
      if (cost >= least_closing) continue;
      least_closing = cost;
      closing = depths;
      tried.tips_lead = lead;
    }
    for (int k = 0; k < kApproachDirections; ++k) {
      tried.retreat = Direction(k);
      const double unusual = 3.0 * (1.0 - tried.retreat.dot(usual));
      Depths depths = closing;
      double cost = cost_of(tried, depths) + unusual;
      for (const double r : kOnTheWay) {
        if (cost >= least) break;
        Add(ready, r * tried.retreat, object, bottom_z, depths);
        cost = cost_of(tried, depths) + unusual;
      }
      if (cost < least) {
        least = cost;
        best = tried;
      }
    }
  }
  return best;
}

}  // namespace holdfast
