// SPDX-License-Identifier: MIT
#include "generator/matching/leg_placement.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "generator/body/limb_ik.h"

namespace holdfast {
namespace {

constexpr std::array<Side, 2> kSides = {Side::kLeft, Side::kRight};
constexpr double kMaxRise = 0.04;  // meters, of a foot out of reach
constexpr double kMinBend = 3.0 * std::numbers::pi / 180.0;

Limb WalkingLeg(Side side) {
  Limb leg = Leg(side);
  leg.min_flexion_rad = kMinBend;
  return leg;
}

Eigen::Vector3d HipOf(const Eigen::Matrix3Xd& rest_joints, const Limb& leg,
                      const BodyFrame& frame) {
  return frame.pelvis + frame.local[0] * (rest_joints.col(leg.root) - rest_joints.col(0));
}

Eigen::Quaterniond Relative(const Eigen::Matrix3d& parent, const Eigen::Matrix3d& child) {
  return Eigen::Quaterniond(Eigen::Matrix3d(parent.transpose() * child)).normalized();
}

}  // namespace

FeetTarget FeetOf(const BodyPlacement& placed) {
  FeetTarget feet;
  for (std::size_t k = 0; k < kSides.size(); ++k) {
    const int ankle = Leg(kSides[k]).end;
    feet.ankle[k] = placed.joints.col(ankle);
    feet.rotation[k] = placed.rotation[ankle];
  }
  return feet;
}

std::vector<FeetTarget> FeetOf(std::span<const BodyPlacement> placed) {
  std::vector<FeetTarget> feet;
  feet.reserve(placed.size());
  for (const BodyPlacement& frame : placed) feet.push_back(FeetOf(frame));
  return feet;
}

double PlaceLegs(const Eigen::Matrix3Xd& rest_joints, const FeetTarget& feet, BodyFrame& frame) {
  const BodyPlacement placed = Place(rest_joints, frame);
  double missed = 0.0;
  for (std::size_t k = 0; k < kSides.size(); ++k) {
    const Limb leg = WalkingLeg(kSides[k]);
    const Eigen::Vector3d hip = placed.joints.col(leg.root);
    // The knee direction of a straight leg is undefined, and a network may bend a leg backwards. In
    // both cases the front of the thigh is used.
    const Eigen::Vector3d middle = 0.5 * (hip + placed.joints.col(leg.end));
    const Eigen::Vector3d front = placed.rotation[leg.root].col(2);
    const Eigen::Vector3d knee = placed.joints.col(leg.middle) - middle;
    const Eigen::Vector3d pole = knee + (0.05 - std::min(0.0, knee.dot(front))) * front;
    const LimbPose solved = SolveLimb(rest_joints, leg, hip, feet.ankle[k], pole);
    frame.local[leg.root] = Relative(placed.rotation[0], solved.upper);
    frame.local[leg.middle] = Relative(solved.upper, solved.lower);
    frame.local[leg.end] = Relative(solved.lower, feet.rotation[k]);
    missed = std::max(missed, (solved.end - feet.ankle[k]).norm());
  }
  return missed;
}

double DrawIntoReach(const Eigen::Matrix3Xd& rest_joints, const BodyFrame& frame,
                     FeetTarget& feet) {
  double drawn = 0.0;
  for (std::size_t k = 0; k < kSides.size(); ++k) {
    const Limb leg = WalkingLeg(kSides[k]);
    const Eigen::Vector3d hip = HipOf(rest_joints, leg, frame);
    const Eigen::Vector3d place = feet.ankle[k] - hip;
    const double reach = MaxReach(rest_joints, leg);
    if (place.norm() <= reach) continue;
    Eigen::Vector3d to = place * (reach / place.norm());
    to.z() = std::min(to.z(), place.z() + kMaxRise);
    const double across = std::sqrt(std::max(0.0, reach * reach - to.z() * to.z()));
    to.head<2>() = place.head<2>().normalized() * across;
    feet.ankle[k] = hip + to;
    drawn = std::max(drawn, (to - place).norm());
  }
  return drawn;
}

std::vector<double> PelvisSink(const Eigen::Matrix3Xd& rest_joints,
                               const std::vector<BodyFrame>& frames,
                               const std::vector<FeetTarget>& feet) {
  const int count = static_cast<int>(frames.size());
  std::vector<double> needed(frames.size(), 0.0);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    for (std::size_t k = 0; k < kSides.size(); ++k) {
      const Limb leg = WalkingLeg(kSides[k]);
      const Eigen::Vector3d to_ankle = feet[t].ankle[k] - HipOf(rest_joints, leg, frames[t]);
      const double reach = MaxReach(rest_joints, leg);
      const double across = std::min(to_ankle.head<2>().norm(), reach);
      const double highest = std::sqrt(reach * reach - across * across);
      needed[t] = std::max(needed[t], -to_ankle.z() - highest);
    }
  }
  // A sliding maximum followed by a bell of the same width is smooth and never less than needed.
  constexpr int kRadius = 5;
  std::vector<double> greatest(frames.size(), 0.0), sink(frames.size(), 0.0);
  for (int t = 0; t < count; ++t) {
    for (int s = std::max(0, t - kRadius); s <= std::min(count - 1, t + kRadius); ++s) {
      greatest[t] = std::max(greatest[t], needed[s]);
    }
  }
  for (int t = 0; t < count; ++t) {
    double total = 0.0;
    for (int s = -kRadius; s <= kRadius; ++s) {
      const double weight = 1.0 + std::cos(std::numbers::pi * s / (kRadius + 1.0));
      sink[t] += weight * greatest[std::clamp(t + s, 0, count - 1)];
      total += weight;
    }
    sink[t] /= total;
  }
  return sink;
}

}  // namespace holdfast
