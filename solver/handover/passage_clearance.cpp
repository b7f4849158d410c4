// SPDX-License-Identifier: MIT
#include "solver/handover/passage_clearance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "solver/hand/hand_landmarks.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kFree = 0.0007;     // metres: no deeper is clear
constexpr double kWallFree = 0.001;  // metres that balls are off the skin
constexpr double kSoft = 0.002;      // metres that fingers give way to fingers
constexpr double kDepthCost = 30.0;  // metres of retreat that a metre of depth is worth
constexpr double kLeave = 8.0;       // m/s^2: no hand leaves faster
constexpr double kRetreatStep = 0.003;
constexpr int kRetreatSteps = 60;
constexpr double kBump_s = 0.17;  // half of the time in which a retreat comes and goes

Isometry3d Shifted(Isometry3d object_from_wrist, const Vector3d& shift) {
  object_from_wrist.translation() += shift;
  return object_from_wrist;
}

}  // namespace

PassageClearance::PassageClearance(const HandAnatomy& anatomy, const DistanceGrid& object,
                                   const PassageFrame& held, double frame_rate)
    : anatomy_(anatomy),
      object_(object),
      edge_(held.t),
      frame_rate_(frame_rate),
      in_object_(std::max(kFree, InObject(held, held.object_from_wrist))),
      in_other_(std::max(kFree, InOther(held, held.object_from_wrist))),
      of_walls_(held.balls.cols()) {
  for (Eigen::Index b = 0; b < held.balls.cols(); ++b) {
    const Vector3d center = held.object_from_wrist * held.balls.col(b).head<3>();
    of_walls_(b) = kWallFree + std::max(0.0, held.balls(3, b) - object_.Linear(center));
  }
}

double PassageClearance::InObject(const PassageFrame& frame,
                                  const Isometry3d& object_from_wrist) const {
  return std::max(
      0.0,
      -SkinDistances(anatomy_.landmarks, object_, object_from_wrist, frame.skin, 0.0).minCoeff());
}

double PassageClearance::OfWalls(const PassageFrame& frame,
                                 const Isometry3d& object_from_wrist) const {
  double deepest = 0.0;
  for (Eigen::Index b = 0; b < frame.balls.cols(); ++b) {
    const double distance = object_.Linear(object_from_wrist * frame.balls.col(b).head<3>());
    deepest = std::max(deepest, frame.balls(3, b) - distance - of_walls_(b));
  }
  return deepest;
}

double PassageClearance::InOther(const PassageFrame& frame,
                                 const Isometry3d& object_from_wrist) const {
  if (frame.other.cols() == 0) return 0.0;
  const Eigen::AlignedBox3d box(frame.skin.rowwise().minCoeff(), frame.skin.rowwise().maxCoeff());
  const Isometry3d wrist_from_object = object_from_wrist.inverse();
  double deepest = 0.0;
  for (Eigen::Index b = 0; b < frame.other.cols(); ++b) {
    const Vector3d center = wrist_from_object * frame.other.col(b).head<3>();
    const double radius = frame.other(3, b);
    if (radius - box.exteriorDistance(center) <= deepest) continue;
    const double nearest = (frame.skin.colwise() - center).colwise().squaredNorm().minCoeff();
    deepest = std::max(deepest, radius - std::sqrt(nearest));
  }
  return deepest;
}

double PassageClearance::TooDeep(const PassageFrame& frame, const Vector3d& shift) const {
  const Isometry3d moved = Shifted(frame.object_from_wrist, shift);
  return std::max({0.0, InObject(frame, moved) - in_object_, OfWalls(frame, moved),
                   0.5 * (InOther(frame, moved) - in_other_ - kSoft)});
}

double PassageClearance::Retreat(const Vector3d& line, int opening,
                                 std::span<PassageFrame> frames) const {
  constexpr int kRounds = 3;
  for (PassageFrame& frame : frames) frame.retreat = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    bool clear = true;
    std::vector<double> needed;
    for (const PassageFrame& frame : frames) {
      needed.push_back(LeastRetreat(frame, line));
      clear &= needed.back() == frame.retreat;
    }
    if (clear) break;
    Smooth(needed, opening, frames);
  }
  double cost = 0.0;
  for (const PassageFrame& frame : frames) {
    cost += frame.retreat + kDepthCost * TooDeep(frame, frame.retreat * line);
  }
  return cost;
}

// From the one it has on: what is worth its depth.
double PassageClearance::LeastRetreat(const PassageFrame& frame, const Vector3d& line) const {
  const double seconds = std::abs(frame.t - edge_) / frame_rate_;
  const double most = 0.5 * kLeave * seconds * seconds;
  double best = frame.retreat, least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kRetreatSteps; ++i) {
    const double retreat = frame.retreat + kRetreatStep * i;
    if (i > 0 && (retreat > most || retreat >= least)) break;
    const double depth = TooDeep(frame, retreat * line);
    const double cost = kDepthCost * depth + retreat;
    if (cost < least - 1e-9) {
      least = cost;
      best = retreat;
    }
    if (depth <= 0.0) break;
  }
  return best;
}

// No less than needed, rising and falling smoothly.
void PassageClearance::Smooth(const std::vector<double>& needed, int opening,
                              std::span<PassageFrame> frames) const {
  const double bump = std::max(1.0, std::round(kBump_s * frame_rate_));
  for (std::size_t k = 0; k < frames.size(); ++k) {
    double most = needed[k];
    for (std::size_t j = 0; j < frames.size(); ++j) {
      const int from_hold = static_cast<int>(j) + 1;
      const double width =
          std::min<double>(bump, from_hold > opening ? from_hold - opening + 1 : from_hold);
      const double apart = std::abs(static_cast<double>(j) - static_cast<double>(k)) / width;
      if (apart >= 1.0) continue;
      most = std::max(most, 0.5 * needed[j] * (1.0 + std::cos(std::numbers::pi * apart)));
    }
    frames[k].retreat = most;
  }
}

}  // namespace holdfast
