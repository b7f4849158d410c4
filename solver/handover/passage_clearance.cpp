// SPDX-License-Identifier: MIT
#include "solver/handover/passage_clearance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <ceres/loss_function.h>

#include "generator/scripted/minimum_jerk.h"
#include "geometry/rotation.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/terms/hand/paper_terms.h"
#include "solver/terms/motion/goal_terms.h"
#include "solver/terms/motion/posture_terms.h"
#include "solver/unknowns/ceres_solve.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kFree = 0.0007;     // meters: clear up to this depth
constexpr double kWallFree = 0.001;  // meters: distance of the balls from the skin
constexpr double kSoft = 0.002;      // meters: softness of fingers against fingers
constexpr double kDepthCost = 30.0;  // meters of retreat per meter of depth
constexpr double kLeave = 8.0;       // m/s^2: maximum acceleration of a leaving hand
constexpr double kRetreatStep = 0.003;
constexpr int kRetreatSteps = 60;
constexpr double kBump_s = 0.17;  // half the duration of a retreat

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

// Increases the frame's retreat as long as this is worth the depth.
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

// At least the needed retreats, rising and falling smoothly.
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

namespace {

constexpr double kFollow = 1e-3, kFirmer = 1.6;
constexpr int kRounds = 100;

}  // namespace

Eigen::Matrix3Xd EasedWay(const Eigen::Matrix3Xd& way, const WayEnds& ends,
                          const std::function<bool(int, const Vector3d&)>& is_clear) {
  const auto count = static_cast<int>(way.cols());
  if (count == 0) return way;
  const Vector3d unknown = Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  Eigen::Matrix3Xd path(3, count + 4);
  path << ends[0].value_or(unknown), ends[1].value_or(unknown), way, ends[2].value_or(unknown),
      ends[3].value_or(unknown);
  const auto at = [&](int k) { return path.col(k + 2).data(); };
  ceres::Problem problem;
  std::vector<double> weights(way.cols(), kFollow);
  std::vector<ceres::LossFunctionWrapper*> follow;
  for (int k = 0; k < count; ++k) {
    follow.push_back(new ceres::LossFunctionWrapper(nullptr, ceres::TAKE_OWNERSHIP));
    problem.AddResidualBlock(new NearPoint(way.col(k), 1.0), follow.back(), at(k));
  }
  for (int k = -1; k <= count; ++k) {
    if (path.middleCols<3>(k + 1).hasNaN()) continue;
    problem.AddResidualBlock(new JointAcceleration(1.0, 1.0), nullptr, at(k - 1), at(k), at(k + 1));
  }
  for (const int k : {-2, -1, count, count + 1}) {
    if (problem.HasParameterBlock(at(k))) problem.SetParameterBlockConstant(at(k));
  }
  ceres::Solver::Options options = SparseOptions(10, 1e-12);
  options.initial_trust_region_radius = 1e12;  // linear
  for (int round = 0; round < kRounds; ++round) {
    for (int k = 0; k < count; ++k) {
      follow[k]->Reset(new ceres::ScaledLoss(nullptr, weights[k], ceres::TAKE_OWNERSHIP),
                       ceres::TAKE_OWNERSHIP);
    }
    SolveQuietly(options, problem);
    bool clear = true;
    for (int k = 0; k < count; ++k) {
      if (is_clear(k, path.col(k + 2))) continue;
      clear = false;
      weights[k] *= kFirmer;
    }
    if (clear) return path.middleCols(2, count);
  }
  return way;
}

namespace {

constexpr double kEase_s = 1.0, kMinEase_s = 0.3;

Isometry3d WristAt(const HandModel& hand, const Clip& clip, int t) {
  return WristIn(hand, clip.pose[t], clip.trans.col(t));
}

WristOffset OffsetBetween(const Isometry3d& from, const Isometry3d& to) {
  const Isometry3d offset = from.inverse() * to;
  return {Eigen::Quaterniond(offset.linear()).normalized(), offset.translation()};
}

// Blend weight: from 0 at `from` over 1 in [begin, end) to 0 at `to`.
double ShareAt(int t, int from, int begin, int end, int to) {
  if (t < begin) return MinimumJerk(static_cast<double>(t - from) / (begin - from));
  return t < end ? 1.0 : MinimumJerk(static_cast<double>(to - t) / (to - end + 1));
}

}  // namespace

std::pair<WristOffset, WristOffset> SplitCorrection(const Isometry3d& giver,
                                                    const Isometry3d& receiver,
                                                    const Isometry3d& giver_from_receiver) {
  ObjectPose met(giver);
  double* const q = met.orientation.coeffs().data();
  ceres::Problem problem;
  problem.AddParameterBlock(q, 4, new RotationManifold);
  problem.AddResidualBlock(new ObjectData(ObjectPose(giver), 1.0), nullptr, q,
                           met.translation.data());
  problem.AddResidualBlock(
      new ObjectData(ObjectPose(receiver), 1.0, ObjectPose(giver_from_receiver)), nullptr, q,
      met.translation.data());
  SolveQuietly(SparseOptions(50, 1e-16), problem);
  return {OffsetBetween(giver, met.Transform()),
          OffsetBetween(receiver, met.Transform() * giver_from_receiver)};
}

void LetHandsMeet(const HandModel& right, const HandModel& left,
                  std::span<const HandSwitch> switches, std::span<const Handover> handovers,
                  Clip& clip) {
  const auto frames = [&](double seconds) {
    return std::max(1, static_cast<int>(std::lround(seconds * clip.frame_rate)));
  };
  int last_end = 0;
  for (const HandSwitch& change : switches) {
    const auto handover = std::ranges::find_if(handovers, [&](const Handover& one) {
      return one.to == change.to && one.frame == change.both_begin;
    });
    const int from = std::max(last_end, change.both_begin - frames(kEase_s));
    const int end = std::max(change.both_begin + 1, change.both_end);
    last_end = end;
    if (handover == handovers.end() || change.both_begin - from < frames(kMinEase_s)) continue;
    const HandModel& giver = change.from == Side::kRight ? right : left;
    const HandModel& receiver = change.to == Side::kRight ? right : left;
    const auto [of_giver, of_receiver] =
        SplitCorrection(WristAt(giver, clip, change.both_begin),
                        WristAt(receiver, clip, change.both_begin), handover->giver_from_receiver);
    const int to = end - 1 + frames(kEase_s);
    for (int t = from + 1; t < std::min(to, clip.NumFrames()); ++t) {
      const double share = ShareAt(t, from, change.both_begin, end, to);
      MoveHand(giver, of_giver.Scaled(share), clip.trans.col(t), clip.pose[t]);
      MoveHand(receiver, of_receiver.Scaled(share), clip.trans.col(t), clip.pose[t]);
    }
  }
}

WristChange LargestChange(const HandModel& hand, const Clip& from, const Clip& to, int begin,
                          int end) {
  WristChange most;
  for (int t = begin; t < std::min({end, from.NumFrames(), to.NumFrames()}); ++t) {
    const Isometry3d was = WristAt(hand, from, t), is = WristAt(hand, to, t);
    most.moved_m = std::max(most.moved_m, (is.translation() - was.translation()).norm());
    most.turned_rad = std::max(most.turned_rad, AngleBetween(is.linear(), was.linear()));
  }
  return most;
}

}  // namespace holdfast
