// SPDX-License-Identifier: MIT
#include "solver/clearance/clearance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "generator/body/pose_builder.h"
#include "geometry/body/body_frames.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "solver/clearance/arm_spline.h"
#include "solver/clearance/body_meeting.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/change_spline.h"

namespace holdfast {
namespace {

constexpr double kKnot_s = 0.2;     // between control points
constexpr double kGiveWay_s = 1.6;  // adjusted before and after a frame that is too deep
constexpr int kFineRounds = 3;
constexpr double kFine_m = 0.004;     // final point spacing
constexpr double kFar_m = 0.015;      // if all 1 cm samples are farther, no point is deep
constexpr double kTouching_m = 5e-4;  // deeper arms are adjusted
constexpr double kTake_s = 0.3;       // time to move from a place where the object rests
constexpr double kHandNear_s = 0.5;   // a hand about to hold may touch
constexpr double kWatched_m = 0.025, kWatchedFinely_m = 0.012;
constexpr double kSolved_hz = 30.0;  // rate of the frames with planes
constexpr double kBend = 0.15;
constexpr double kStay_m = 0.03, kMost_m = 0.07, kMaxTurn_rad = 24.0 * kDegree;  // soft limits
constexpr double kLooseTurn_rad = 180.0 * kDegree, kLooseSigma_m = 0.002;        // of a free hand
constexpr double kLooseStay_m = 0.006, kLooseMost_m = 0.05, kOverTable_m = 0.12;
constexpr double kTableTurn_rad = 10.0 * kDegree;  // of a hand that may carry a full cup
constexpr double kUpright_rad = 30.0 * kDegree, kTurned_rad = 60.0 * kDegree;
constexpr std::size_t kMaxPlanes = 48;

constexpr Side kSides[] = {Side::kRight, Side::kLeft};

ArmChange PriorSigma() {
  ArmChange sigma;
  sigma << 3, 3, 3, 20, 12, 12, 15, 15, 0.5, 15, 15, 15;
  return kDegree * sigma;
}

// Keeps the kMaxPlanes deepest planes.
void KeepDeepest(const std::vector<double>& depths, std::vector<DepthInBody::Plane>& planes) {
  if (planes.size() <= kMaxPlanes) return;
  std::vector<std::size_t> order(planes.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::stable_sort(order, std::ranges::greater{}, [&](std::size_t k) { return depths[k]; });
  std::vector<DepthInBody::Plane> kept;
  for (std::size_t k = 0; k < kMaxPlanes; ++k) kept.push_back(planes[order[k]]);
  planes = std::move(kept);
}

bool IsStill(const ObjectTrack& table) {
  const auto moves = [](const Eigen::Matrix3Xd& values) {
    return (values.colwise() - values.col(0)).cwiseAbs().maxCoeff() > 1e-6;
  };
  return !moves(table.trans) && !moves(table.orient);
}

std::uint8_t Holders(std::span<const std::uint8_t> holding) {
  std::uint8_t all = 0;
  for (const std::uint8_t bits : holding) all |= bits;
  return all;
}

std::vector<std::uint8_t> HoldersAbout(std::span<const std::uint8_t> holding, double frame_rate) {
  const auto frames = static_cast<int>(holding.size());
  const auto reach = static_cast<int>(std::lround(kHandNear_s * frame_rate));
  std::vector<std::uint8_t> near(holding.size());
  for (int t = 0; t < frames; ++t) {
    for (int k = std::max(0, t - reach); k <= std::min(frames - 1, t + reach); ++k) {
      near[t] |= holding[k];
    }
  }
  return near;
}

class BodyKeeper {
 public:
  BodyKeeper(const BodySurface& body, const TriangleMesh& object, const ClearanceOptions& options,
             ClearanceScene scene, Clip& clip)
      : body_(body),
        object_(object),
        options_(options),
        scene_(std::move(scene)),
        clip_(clip),
        moved_(clip),
        frames_(clip.NumFrames()),
        held_by_(Holders(clip.holding_hand)) {
    const TriangleMesh* const table = TableMesh(clip);
    if (table != nullptr && IsStill(*clip.table)) {
      scene_.meeting.AddTable(*table, clip.table->Pose(0));
    }
  }

  ClearanceReport Run() {
    report_.frames.resize(static_cast<std::size_t>(frames_));
    Judge(clip_);
    report_.deep_before = report_.deep;
    report_.worst_before_m = report_.worst_m;
    if (report_.deep == 0 || options_.keep_motion) return report_;
    Solve();
    if (!Finish()) return report_;
    ClearanceReport untouched = report_;
    Judge(moved_);
    KeepWhereBlocked(untouched);
    if (Excess(report_) >= Excess(untouched)) {
      untouched.kept = report_.kept;
      return untouched;
    }
    TellMovement();
    report_.moved = true;
    clip_ = std::move(moved_);
    return report_;
  }

 private:
  struct Arm {
    int index;
    ArmSpline spline;
    std::vector<bool> free;  // per control point
  };

  std::vector<BodyCollisionDetector::Frame> Measure(const Clip& clip,
                                                    const std::vector<int>& frames,
                                                    double within_m = kWatched_m) const {
    std::vector<BodyCollisionDetector::Frame> found(frames.size());
    const auto count = static_cast<int>(frames.size());
    const int together = SharedFramesTogether(count);
    const int blocks = (count + together - 1) / together;
    ParallelFor(blocks, options_.threads, [&](int b) {
      const int begin = b * together, n = std::min(together, count - begin);
      std::vector<JointPose> poses;
      Eigen::Matrix3Xd trans(3, n);
      for (int k = 0; k < n; ++k) {
        const int t = frames[begin + k];
        poses.push_back(clip.pose[t]);
        trans.col(k) = clip.trans.col(t);
      }
      std::vector<BodyState> states(static_cast<std::size_t>(n));
      ForwardFrames(body_, poses, trans, states);
      for (int k = 0; k < n; ++k) {
        const int t = frames[begin + k];
        found[begin + k] = scene_.meeting.Measure(states[k], clip.object->Pose(t),
                                                  clip.holding_hand[t], scene_.near[t], within_m);
      }
    });
    return found;
  }

  // Depths as in `score`, at all its points, with the colliding parts.
  void Judge(const Clip& clip) {
    const OwnBodyScore score = scene_.meter.Measure(clip, options_.threads);
    std::vector<int> by_arms;
    const auto at = [](const std::optional<BodyDepth>& depth, int t) {
      return depth ? depth->depth_mm[t] : 0.0;
    };
    for (int t = 0; t < frames_; ++t) {
      const bool held = clip.holding_hand[t] != 0;
      const double object_in_body = held ? at(score.object, t) : 0.0,
                   object_in_table = held ? at(score.object_in_table, t) : 0.0;
      const double arms_in_body = score.arms.depth_mm[t],
                   arms_in_table = at(score.arms_in_table, t);
      const double of_object = std::max(object_in_body, object_in_table),
                   of_arms = std::max(arms_in_body, arms_in_table);
      report_.frames[t].in_body_m = 1e-3 * std::max(object_in_body, arms_in_body);
      report_.frames[t].in_table =
          std::max(object_in_table, arms_in_table) > std::max(object_in_body, arms_in_body);
      report_.frames[t].depth_m = 1e-3 * std::max(of_object, of_arms);
      report_.frames[t].part = of_object > 0.0 ? MeetingPart::kObject : MeetingPart::kNone;
      if (of_arms > of_object) by_arms.push_back(t);
    }
    const std::vector<BodyCollisionDetector::Frame> which = Measure(clip, by_arms);
    for (std::size_t k = 0; k < by_arms.size(); ++k) {
      report_.frames[by_arms[k]].part = which[k].arm_depth_m[0] >= which[k].arm_depth_m[1]
                                            ? MeetingPart::kRightArm
                                            : MeetingPart::kLeftArm;
    }
    Summarize();
  }

  void Summarize() {
    report_.deep = report_.held_frames = 0;
    report_.worst_m = 0.0;
    report_.worst_part = MeetingPart::kNone;
    report_.worst_in_table = false;
    for (int t = 0; t < frames_; ++t) {
      const ClearanceReport::Frame& frame = report_.frames[t];
      report_.held_frames += clip_.holding_hand[t] != 0;
      report_.deep += frame.depth_m > options_.deep_m;
      if (frame.depth_m <= report_.worst_m) continue;
      report_.worst_m = frame.depth_m;
      report_.worst_frame = t;
      report_.worst_part = frame.part;
      report_.worst_in_table = frame.in_table;
    }
  }

  // Sum of the excess depths over all frames.
  double Excess(const ClearanceReport& report) const {
    double sum = 0.0;
    for (const ClearanceReport::Frame& frame : report.frames) {
      sum += std::max(0.0, frame.depth_m - options_.deep_m);
    }
    return sum;
  }

  // 0 where a hold starts or ends, 1 from kTake_s on: a quintic.
  double Freedom(int t) const {
    const auto reach = static_cast<int>(std::ceil(kTake_s * clip_.frame_rate));
    int away = reach + 1;
    for (int k = std::max(0, t - reach); k <= std::min(frames_ - 1, t + reach); ++k) {
      if ((clip_.holding_hand[k] == 0) != (clip_.holding_hand[t] == 0)) {
        away = std::min(away, std::abs(t - k));
      }
    }
    const double s = std::max(0, away - 1) / static_cast<double>(reach);
    return s * s * s * (10.0 + s * (6.0 * s - 15.0));
  }

  bool HoldsAt(int arm, int t) const { return (clip_.holding_hand[t] & (1 << arm)) != 0; }
  bool Holds(const Arm& arm) const { return (held_by_ & (1 << arm.index)) != 0; }
  double Freedom(const Arm& arm, int t) const { return Holds(arm) ? freedom_[t] : 1.0; }

  // Frees the arms that are too deep, and those that hold the object with them; also a free arm
  // into which the object has moved.
  void FreeAround(int t, const BodyCollisionDetector::Frame& near) {
    const auto reach = static_cast<int>(std::lround(kGiveWay_s / kKnot_s));
    const bool both = clip_.holding_hand[t] == (kHoldsRight | kHoldsLeft);
    for (Arm& arm : arms_) {
      if ((both ? near.depth_m : near.arm_depth_m[arm.index]) <= kTouching_m &&
          near.in_object_m[arm.index] <= options_.deep_m) {
        continue;
      }
      const int knot = arm.spline.Place(t).first;
      for (int k = std::max(0, knot - reach); k < std::min(arm.spline.Size(), knot + 4 + reach);
           ++k) {
        arm.free[k] = true;
      }
    }
  }

  bool IsFree(const Arm& arm, int t) const {
    const int knot = arm.spline.Place(t).first;
    return std::any_of(arm.free.begin() + knot, arm.free.begin() + knot + 4, std::identity{});
  }
  bool IsFree(int t) const { return IsFree(arms_[0], t) || IsFree(arms_[1], t); }

  void Solve() {
    for (int a = 0; a < 2; ++a) {
      ArmSpline spline(frames_, kKnot_s * clip_.frame_rate);
      arms_.push_back({a, spline, std::vector<bool>(spline.Size(), false)});
    }
    std::vector<int> deep;
    for (int t = 0; t < frames_; ++t) {
      freedom_.push_back(Freedom(t));
      if (report_.frames[t].depth_m > options_.deep_m) deep.push_back(t);
    }
    const std::vector<BodyCollisionDetector::Frame> found = Measure(clip_, deep);
    for (std::size_t k = 0; k < deep.size(); ++k) FreeAround(deep[k], found[k]);
    nearest_.assign(static_cast<std::size_t>(frames_), 0.0);
    near_table_.assign(static_cast<std::size_t>(frames_), {});
    std::vector<bool> far(static_cast<std::size_t>(frames_), false);
    Settle(options_.max_rounds, far, kWatched_m);
    for (int t = 0; t < frames_; ++t) far[t] = nearest_[t] < -kFar_m;
    // Refine between the samples, to the accuracy of the final measurement.
    scene_.meeting.LookAt(object_, kFine_m);
    Settle(kFineRounds, far, kWatchedFinely_m);
  }

  // Rounds of solves with updated planes, in frames that are not `far` from touching, at points
  // within `within_m` of the skin.
  void Settle(int rounds, const std::vector<bool>& far, double within_m) {
    const int stride = std::max(1, static_cast<int>(clip_.frame_rate / kSolved_hz));
    for (int round = 0; round < rounds; ++round) {
      std::vector<int> watched;
      for (int t = 0; t < frames_; t += stride) {
        if (IsFree(t)) watched.push_back(t);
      }
      std::vector<BodyCollisionDetector::Frame> near(watched.size());
      std::vector<int> looked, place;
      for (std::size_t k = 0; k < watched.size(); ++k) {
        if (far[watched[k]]) continue;
        looked.push_back(watched[k]);
        place.push_back(static_cast<int>(k));
      }
      std::vector<BodyCollisionDetector::Frame> found = Measure(moved_, looked, within_m);
      double worst = 0.0;
      for (std::size_t k = 0; k < found.size(); ++k) {
        const double deepest_m =
            std::max({found[k].depth_m, found[k].in_object_m[0], found[k].in_object_m[1]});
        worst = std::max(worst, deepest_m);
        nearest_[looked[k]] = found[k].nearest_m;
        near_table_[looked[k]] = found[k].near_table;
        if (deepest_m > options_.deep_m) FreeAround(looked[k], found[k]);
        near[place[k]] = std::move(found[k]);
      }
      if (worst < 0.75 * options_.deep_m) break;
      SolveRound(watched, near);
      Apply();
    }
  }

  void SolveRound(const std::vector<int>& watched,
                  const std::vector<BodyCollisionDetector::Frame>& near) {
    ceres::Problem problem;
    for (Arm& arm : arms_) {
      if (std::ranges::none_of(arm.free, std::identity{})) continue;
      for (int k = 0; k < arm.spline.Size(); ++k) {
        problem.AddParameterBlock(arm.spline.Knot(k), 12);
        if (!arm.free[k]) problem.SetParameterBlockConstant(arm.spline.Knot(k));
      }
      for (int k = 1; k + 1 < arm.spline.Size(); ++k) {
        problem.AddResidualBlock(new ArmSplinePrior(PriorSigma(), kBend), nullptr,
                                 arm.spline.Knot(k - 1), arm.spline.Knot(k),
                                 arm.spline.Knot(k + 1));
      }
    }
    for (std::size_t k = 0; k < watched.size(); ++k) AddFrame(problem, watched[k], near[k]);
    constexpr int kIterations = 16;
    SolveQuietly(SparseOptions(kIterations, 1e-4), problem);
  }

  void AddFrame(ceres::Problem& problem, int t, const BodyCollisionDetector::Frame& near) {
    BodyState base, now;
    ForwardJoints(body_.RestJoints(), clip_.pose[t], clip_.trans.col(t), base);
    ForwardJoints(body_.RestJoints(), moved_.pose[t], moved_.trans.col(t), now);
    std::vector<ArmFrame> arm_frames;
    std::vector<double*> knots;
    Eigen::Vector4d basis;
    for (Arm& arm : arms_) {
      const Side side = kSides[arm.index];
      const auto [knot, weights] = arm.spline.Place(t);
      basis = Freedom(arm, t) * weights;
      const ArmFrame& frame = arm_frames.emplace_back(body_.RestJoints(), side, base);
      if (!IsFree(arm, t)) continue;
      HandStay stay;
      stay.sigma_m = kStay_m;
      stay.sigma_rad << kUpright_rad, kUpright_rad, kTurned_rad;
      stay.most_m = kMost_m;
      stay.most_rad = near_table_[t][arm.index] ? kTableTurn_rad : kMaxTurn_rad;
      if (!HoldsAt(arm.index, t)) {
        stay.most_rad = kLooseTurn_rad;
        stay.sigma_most_m = kLooseSigma_m;
        stay.sigma_m = kLooseStay_m;
        stay.most_m = near_table_[t][arm.index] ? kOverTable_m : kLooseMost_m;
      }
      stay.wrist = base.WorldFromJoint(WristJoint(side));
      std::vector<double*> own;
      for (int k = 0; k < 4; ++k) own.push_back(arm.spline.Knot(knot + k));
      problem.AddResidualBlock(new ClearanceBlock(frame, Planes(near.near[arm.index], side, now),
                                                  stay, ArmRange(side, frame), basis),
                               nullptr, own);
      knots.insert(knots.end(), own.begin(), own.end());
    }
    if (clip_.holding_hand[t] != (kHoldsRight | kHoldsLeft) || knots.size() < 8) return;
    HandClosure closure;
    closure.right_from_left =
        base.WorldFromJoint(kRightWrist).inverse() * base.WorldFromJoint(kLeftWrist);
    problem.AddResidualBlock(new ClosureBlock(arm_frames[0], arm_frames[1], closure, basis),
                             nullptr, knots);
  }

  DepthInBody Planes(const std::vector<BodyCollisionDetector::Point>& near, Side side,
                     const BodyState& now) const {
    DepthInBody depth;
    std::vector<double> depths;
    depth.margin_m = options_.margin_m;
    // A point beyond the middle of a thigh is nearest to its far side: follow the majority.
    Eigen::Vector3d out = Eigen::Vector3d::Zero();
    const auto direction = [](const OwnBody::Touch& touch, const Eigen::Vector3d& at) {
      constexpr double kOnSkin = 1e-4;
      return std::abs(touch.depth) > kOnSkin ? Eigen::Vector3d((touch.surface - at) / touch.depth)
                                             : touch.normal;
    };
    for (const BodyCollisionDetector::Point& point : near) {
      if (point.touch.depth > 0.0) out += point.touch.depth * direction(point.touch, point.at);
    }
    out.stableNormalize();
    const Eigen::Isometry3d wrist = now.WorldFromJoint(WristJoint(side)).inverse(),
                            elbow = now.WorldFromJoint(JointOfArm(side, kArmElbow)).inverse();
    for (const BodyCollisionDetector::Point& point : near) {
      const Eigen::Vector3d normal = direction(point.touch, point.at);
      if (point.touch.depth > 0.0 && normal.dot(out) < -0.2) continue;
      const Eigen::Vector3d surface =
          point.touch.surface - (point.may_touch ? options_.margin_m : 0.0) * normal;
      depth.planes.push_back(
          {elbow * point.at, wrist * point.at, point.wrist_share, surface, normal});
      depths.push_back(point.touch.depth);
    }
    KeepDeepest(depths, depth.planes);
    return depth;
  }

  // Applies the changes to the clip; wrists only, the object follows.
  void Apply() {
    for (int t = 0; t < frames_; ++t) {
      JointPose pose = clip_.pose[t];
      for (const Arm& arm : arms_) {
        if (Freedom(arm, t) == 0.0 || !IsFree(arm, t)) continue;
        const ArmChange change = Freedom(arm, t) * arm.spline.At(t);
        for (int k = 0; k < 4; ++k) {
          auto column = pose.col(JointOfArm(kSides[arm.index], k));
          column =
              UnwrapAxisAngle(LogSO3(ExpSO3(column) * ExpSO3(change.segment<3>(3 * k))), column);
        }
      }
      if (pose == clip_.pose[t]) continue;
      moved_.pose[t] = pose;
      MoveObject(t);
    }
  }

  Eigen::Isometry3d Wrist(const Clip& clip, int t, int arm) const {
    BodyState state;
    ForwardJoints(body_.RestJoints(), clip.pose[t], clip.trans.col(t), state);
    return state.WorldFromJoint(WristJoint(kSides[arm]));
  }

  // Moves the object with the first holding hand, if any.
  void MoveObject(int t) {
    const std::uint8_t bits = clip_.holding_hand[t];
    if (bits == 0) return;
    const int arm = (bits & kHoldsRight) != 0 ? 0 : 1;
    const Eigen::Isometry3d was = Wrist(clip_, t, arm), is = Wrist(moved_, t, arm);
    if (is.matrix() == was.matrix()) return;  // only the other arm changed
    const Eigen::Isometry3d motion = is * was.inverse();
    moved_.object->SetPose(t, motion * clip_.object->Pose(t));
  }

  // Moves the left hand exactly to its pose on the object. False if it cannot reach it.
  bool Finish() {
    for (int t = 0; t < frames_; ++t) {
      if (clip_.holding_hand[t] != (kHoldsRight | kHoldsLeft) || moved_.pose[t] == clip_.pose[t]) {
        continue;
      }
      const Eigen::Isometry3d target =
          Wrist(moved_, t, 0) * Wrist(clip_, t, 0).inverse() * Wrist(clip_, t, 1);
      JointPose& pose = moved_.pose[t];
      const JointPose solved = pose;
      constexpr double kExact_m = 1e-5;
      if (MoveWrist(body_.RestJoints(), Side::kLeft, target.linear(), target.translation(),
                    moved_.trans.col(t), pose) > kExact_m) {
        return false;
      }
      for (int k = kArmShoulder; k <= kArmWrist; ++k) {
        const int joint = JointOfArm(Side::kLeft, k);
        pose.col(joint) = UnwrapAxisAngle(pose.col(joint), solved.col(joint));
      }
    }
    return true;
  }

  // Restores the clip, between frames without adjusted arms, where the body is not kept free or a
  // wrist exceeds the bounds. A hand that takes hold of an object may stay in the table.
  // `untouched`: the report on the clip.
  void KeepWhereBlocked(const ClearanceReport& untouched) {
    for (int begin = 0, end = 0; begin < frames_; begin = end + 1) {
      bool blocked = false;
      for (end = begin; end < frames_ && IsFree(end); ++end) {
        blocked = blocked || report_.frames[end].in_body_m > options_.max_left_m;
        for (int arm = 0; arm < 2; ++arm) {
          if (!HoldsAt(arm, end)) continue;
          const Eigen::Isometry3d was = Wrist(clip_, end, arm), is = Wrist(moved_, end, arm);
          blocked = blocked ||
                    (is.translation() - was.translation()).norm() > options_.max_shift_m ||
                    AngleBetween(is.linear(), was.linear()) > options_.max_turn_rad;
        }
      }
      for (int t = begin; blocked && t < end; ++t) {
        moved_.pose[t] = clip_.pose[t];
        moved_.object->trans.col(t) = clip_.object->trans.col(t);
        moved_.object->orient.col(t) = clip_.object->orient.col(t);
        report_.frames[t] = untouched.frames[t];
        report_.kept += untouched.frames[t].depth_m > options_.deep_m;
      }
    }
    Summarize();
  }

  void TellMovement() {
    double held = 0.0, loose = 0.0, before = 0.0, after = 0.0;
    int loose_frames = 0;
    for (const Arm& arm : arms_) {
      std::vector<Eigen::Vector3d> was, is, turn;
      for (int t = 0; t < frames_; ++t) {
        const Eigen::Isometry3d wrist = Wrist(clip_, t, arm.index),
                                now = Wrist(moved_, t, arm.index);
        was.push_back(wrist.translation());
        is.push_back(now.translation());
        turn.push_back(LogSO3(now.linear() * wrist.linear().transpose()));
        if (HoldsAt(arm.index, t)) {
          report_.turn_max_rad = std::max(report_.turn_max_rad, turn[t].norm());
          if (t > 0) {
            const double speed = clip_.frame_rate * (turn[t] - turn[t - 1]).norm();
            report_.turn_speed_max_rad_s = std::max(report_.turn_speed_max_rad_s, speed);
          }
        }
        const double shift = (is[t] - was[t]).norm();
        if (HoldsAt(arm.index, t)) {
          double& farther = report_.frames[t].wrist_shift_m;
          farther = std::max(farther, shift);
          continue;
        }
        loose += shift;
        ++loose_frames;
        report_.free_shift_max_m = std::max(report_.free_shift_max_m, shift);
      }
      for (int t = 1; t + 1 < frames_; ++t) {
        if (is[t] == was[t]) continue;
        before += (was[t - 1] - 2.0 * was[t] + was[t + 1]).norm();
        after += (is[t - 1] - 2.0 * is[t] + is[t + 1]).norm();
      }
    }
    for (const ClearanceReport::Frame& frame : report_.frames) {
      report_.shift_max_m = std::max(report_.shift_max_m, frame.wrist_shift_m);
      held += frame.wrist_shift_m;
    }
    report_.shift_mean_m = held / std::max(1, report_.held_frames);
    report_.free_shift_mean_m = loose / std::max(1, loose_frames);
    if (before > 0.0) report_.acceleration_ratio = after / before;
  }

  const BodySurface& body_;
  const TriangleMesh& object_;
  const ClearanceOptions& options_;
  ClearanceScene scene_;
  Clip& clip_;
  Clip moved_;
  int frames_;
  std::uint8_t held_by_;
  std::vector<double> freedom_;
  std::vector<double> nearest_;  // maximum depth of a point, per frame
  std::vector<std::array<bool, 2>> near_table_;
  std::vector<Arm> arms_;
  ClearanceReport report_;
};

}  // namespace

std::vector<std::string> ClearanceWarnings(const ClearanceReport& report) {
  std::vector<std::string> warnings;
  const ClearanceOptions bounds;
  if (report.deep > 0) {
    warnings.push_back(
        fmt::format("the {} penetrates the {} by more than {:.0f} mm in {} of {} frames, by up to "
                    "{:.0f} mm in frame {}",
                    MeetingPartName(report.worst_part), report.worst_in_table ? "table" : "body",
                    1e3 * bounds.deep_m, report.deep, report.frames.size(), 1e3 * report.worst_m,
                    report.worst_frame));
  }
  if (report.kept > 0) {
    warnings.push_back(fmt::format(
        "penetration remains in {} frames, where arms and object keep the clip's motion: moving "
        "the wrist by at most {:.0f} cm and {:.0f} degrees cannot avoid it",
        report.kept, 1e2 * bounds.max_shift_m, bounds.max_turn_rad / kDegree));
  }
  return warnings;
}

ClearanceScene::ClearanceScene(const BodySurface& body, const TriangleMesh& object,
                               std::span<const std::uint8_t> holding, double frame_rate)
    : near(HoldersAbout(holding, frame_rate)),
      meeting(body, object, near),
      meter(body, &object, Holders(holding)) {}

ClearanceReport KeepOutOfBody(const BodySurface& body, const TriangleMesh& object,
                              const ClearanceOptions& options, Clip& clip) {
  if (!clip.object || body.Model().LoneHand()) return {};
  if (clip.holding_hand.size() != clip.pose.size()) {
    throw Error("holding_hand", "has a different number of frames than the clip",
                "Give one number (1 right, 2 left, 3 both) for each frame");
  }
  return KeepOutOfBody(body, object, options,
                       ClearanceScene(body, object, clip.holding_hand, clip.frame_rate), clip);
}

ClearanceReport KeepOutOfBody(const BodySurface& body, const TriangleMesh& object,
                              const ClearanceOptions& options, ClearanceScene scene, Clip& clip) {
  return BodyKeeper(body, object, options, std::move(scene), clip).Run();
}

}  // namespace holdfast
