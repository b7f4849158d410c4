// SPDX-License-Identifier: MIT
#include "solver/fit/clip_refinement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <ceres/loss_function.h>
#include <ceres/problem.h>

#include "geometry/error.h"
#include "geometry/rotation.h"
#include "geometry/score/hand_object_score.h"
#include "solver/fit/finger_repair.h"
#include "solver/fit/frame_fitter.h"
#include "solver/terms/hand/paper_terms.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kSlowFrames = 3.0;    // slower changes are motion, not noise
constexpr double kRigid_m = 0.004;     // maximum shift of an object in a firm hold
constexpr double kRigid_rad = 0.07;    // maximum rotation in it
constexpr double kStill_m_s = 0.04;    // maximum speed of an object at rest
constexpr double kGround_m = 0.015;    // maximum height above the ground for resting on it
constexpr double kNearRest_s = 0.5;    // a support extends this long before and after
constexpr double kNearRest_m = 0.10;   // and this far around
constexpr double kClean_m = 0.001;     // anchors have no deeper penetration
constexpr int kMinHold = 3;            // frames
constexpr double kUnmoved_m = 0.02;    // maximum shift of an object that is only touched
constexpr double kUnmoved_rad = 0.14;  // maximum rotation of it
constexpr double kTouch_s = 0.15;      // margin of a touch, before and after
constexpr double kTouch_m = 0.002;     // contact threshold of skin

ObjectPose PoseOf(const Isometry3d& transform) {
  return {Eigen::Quaterniond(transform.linear()).normalized(), transform.translation()};
}

// Poses relative to a mean: translation and rotation vector, (3 x n) each.
struct Deviation {
  Deviation(std::span<const Isometry3d> poses, const Isometry3d& mean)
      : shift(3, poses.size()), turn(3, poses.size()) {
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const auto column = static_cast<Eigen::Index>(k);
      shift.col(column) = poses[k].translation() - mean.translation();
      turn.col(column) = LogSO3(mean.linear().transpose() * poses[k].linear());
    }
  }
  Isometry3d At(Eigen::Index k, const Isometry3d& mean) const {
    Isometry3d pose = mean;
    pose.translation() += shift.col(k);
    pose.linear() = mean.linear() * ExpSO3(turn.col(k));
    return pose;
  }
  Deviation Smooth() const {
    Deviation smooth = *this;
    smooth.shift = GaussianFilter(shift, kSlowFrames);
    smooth.turn = GaussianFilter(turn, kSlowFrames);
    return smooth;
  }
  Matrix3Xd shift, turn;
};

double RootMeanSquare(const Matrix3Xd& columns) {
  return columns.cols() == 0
             ? 0.0
             : std::sqrt(columns.squaredNorm() / static_cast<double>(columns.cols()));
}

// A hold under construction.
struct Hold {
  RefinedHold about;
  int hand;
  Isometry3d anchor;                 // object in the wrist frame
  FingerPose fingers, fingers_mean;  // without and with penetration
  std::vector<Isometry3d> relation;  // slow motion in the wrist frame, per frame of the hold
  Matrix3Xd at;
};

class Refiner {
 public:
  Refiner(const Clip& clip, std::span<const HandModel* const> hands, const FitObject& object,
          std::span<const std::uint8_t> holding, const FitOptions& options)
      : clip_(clip),
        hands_(hands),
        object_(object),
        options_(options),
        holding_(holding.begin(), holding.end()),
        data_(ObjectPoses(clip)) {
    for (const HandModel* hand : hands) {
      wrists_.push_back(WristPoses(clip, hand->Surface().RestJoints(), hand->HandSide()));
    }
  }

  RefineResult Run(const std::function<bool(int, int)>& progress) {
    lies_ = ObjectLies();
    for (std::size_t h = 0; h < hands_.size(); ++h) FindHolds(static_cast<int>(h));
    const int frames = clip_.NumFrames();
    std::vector<FittedFrame> fitted(static_cast<std::size_t>(frames));
    ClipProblem problem{clip_, hands_, object_, {}, {}, false};
    problem.goals.resize(static_cast<std::size_t>(frames));
    Start(fitted);
    RefineResult result;
    FindRests(problem.goals, fitted, result.rests);
    for (const Hold& hold : holds_) {
      problem.holds.push_back(
          {hold.hand, hold.about.begin, hold.about.end, hold.at, !hold.about.rigid});
      result.holds.push_back(hold.about);
    }
    result.report = SolveClip(problem, options_, options_.threads, fitted, progress);
    if (result.report.failed) return result;
    std::vector<std::uint8_t> given_way = holding_;
    FindTouches(fitted, given_way, result.touches);
    if (!result.touches.empty()) GiveWay(result.touches, fitted, progress, result.report);
    result.clip = ApplyFit(clip_, hands_, given_way, fitted, options_.release_s);
    result.clip.holding_hand = holding_;
    return result;
  }

 private:
  bool Holds(int hand, int t) const { return (holding_[t] & Bit(hand)) != 0; }

  void FindHolds(int hand) {
    for (int t = 0; t < clip_.NumFrames(); ++t) {
      if (!Holds(hand, t)) continue;
      int end = t;
      while (end < clip_.NumFrames() && Holds(hand, end)) ++end;
      if (lies_ && 2 * (end - t) <= clip_.NumFrames()) {
        for (int u = t; u < end; ++u) holding_[u] &= static_cast<std::uint8_t>(~Bit(hand));
      } else {
        AddHold(hand, t, end);
      }
      t = end;
    }
  }

  std::uint8_t Bit(int hand) const { return HoldingBit(hands_[hand]->HandSide()); }

  // Whether the object stays in place, whatever the holding labels are.
  bool ObjectLies() const {
    const Deviation deviation(data_, RobustMean(data_));
    return deviation.shift.colwise().norm().maxCoeff() < kUnmoved_m &&
           deviation.turn.colwise().norm().maxCoeff() < kUnmoved_rad;
  }

  // Finds frames in which a hand penetrates the object though it is not within or close to a hold.
  // Touches are added to holding_, and with the frames around them to `given_way`.
  void FindTouches(const std::vector<FittedFrame>& fitted, std::vector<std::uint8_t>& given_way,
                   std::vector<RefinedTouch>& touches) {
    if (!lies_ || !object_.distance || options_.lambda_wrist <= 0.0) return;
    const int frames = clip_.NumFrames();
    const auto reach = [&](double seconds) {
      return static_cast<int>(std::lround(seconds * clip_.frame_rate));
    };
    for (std::size_t h = 0; h < hands_.size(); ++h) {
      const int hand = static_cast<int>(h);
      std::vector<double> gap = Gaps(*hands_[h], fitted);
      for (int t = 0; t < frames; ++t) {
        if (!Holds(hand, t)) continue;
        for (int u = std::max(0, t - reach(options_.release_s));
             u < std::min(frames, t + reach(options_.release_s) + 1); ++u) {
          gap[u] = kTouch_m;
        }
      }
      for (int t = 0; t < frames; ++t) {
        if (gap[t] >= kTouch_m) continue;
        int end = t, deepest = t;
        for (int u = t; u < std::min(frames, end + 2 * reach(kTouch_s) + 1); ++u) {
          if (gap[u] < kTouch_m) end = u;
          if (gap[u] < gap[deepest]) deepest = u;
        }
        ++end;
        if (gap[deepest] < 0.0) AddTouch(hand, t, end, reach(kTouch_s), given_way, touches);
        t = end;
      }
    }
  }

  void AddTouch(int hand, int begin, int end, int around, std::vector<std::uint8_t>& given_way,
                std::vector<RefinedTouch>& touches) {
    touches.push_back({hands_[hand]->HandSide(), begin, end});
    for (int t = std::max(0, begin - around); t < std::min(clip_.NumFrames(), end + around); ++t) {
      given_way[t] |= Bit(hand);
      if (t >= begin && t < end) holding_[t] |= Bit(hand);
    }
    touched_.push_back({hand, std::max(0, begin - around),
                        std::min(clip_.NumFrames(), end + around), Matrix3Xd(3, 0), false});
  }

  // Distance from the skin of a hand in the clip to the object, meters, per frame; negative inside.
  std::vector<double> Gaps(const HandModel& hand, const std::vector<FittedFrame>& fitted) const {
    std::vector<double> gaps(fitted.size());
    ForEachPosedHand(clip_, hand, options_.threads, [&](int t, const HandState& state) {
      const Matrix3Xd skin = fitted[t].object.Transform().inverse() * state.Vertices();
      double least = std::numeric_limits<double>::infinity();
      for (Eigen::Index i = 0; i < skin.cols(); ++i) {
        least = std::min(least, object_.distance->Distance(skin.col(i)));
      }
      gaps[t] = least;
    });
    return gaps;
  }

  // Moves hands that only touch out of the objects, which stay in place.
  void GiveWay(const std::vector<RefinedTouch>& touches, std::vector<FittedFrame>& fitted,
               const std::function<bool(int, int)>& progress, ClipReport& report) const {
    ClipProblem problem{clip_, hands_, object_, touched_, {}, false, true};
    for (std::size_t k = 0; k < touches.size(); ++k) {
      const ClipHold& hold = touched_[k];
      for (int t = hold.begin; t < hold.end; ++t) {
        fitted[t].hands[hold.hand] = {FingersOf(clip_.pose[t], touches[k].side), {}};
      }
    }
    const ClipReport touch = SolveClip(problem, options_, options_.threads, fitted, progress);
    report.iterations += touch.iterations;
    report.converged &= touch.converged;
    report.failed |= touch.failed;
    report.cost_before += touch.cost_before;
    report.cost_after += touch.cost_after;
    report.solve_ms += touch.solve_ms;
    for (std::size_t t = 0; t < touch.frames.size(); ++t) report.frames[t] += touch.frames[t];
  }

  std::vector<Isometry3d> Relation(int hand, int begin, int end) const {
    std::vector<Isometry3d> relation;
    for (int t = begin; t < end; ++t) {
      relation.push_back(wrists_[hand][t].inverse() * data_[t]);
    }
    return relation;
  }

  void AddHold(int hand, int begin, int end) {
    const int first = begin, last = end;
    Hold hold;
    hold.hand = hand;
    for (;;) {
      const std::vector<Isometry3d> relation = Relation(hand, begin, end);
      hold.anchor = RobustMean(relation);
      const Deviation deviation(relation, hold.anchor);
      const Deviation slow = deviation.Smooth();
      const double noise = WhiteNoise(deviation.shift), turn_noise = WhiteNoise(deviation.turn);
      const double left = NoiseAfterSmoothing(kSlowFrames) * std::sqrt(3.0);
      const double shift_most = kRigid_m + 2.0 * left * noise;
      const double turn_most = kRigid_rad + 2.0 * left * turn_noise;
      hold.about = {
          hands_[hand]->HandSide(),
          begin,
          end,
          RootMeanSquare(slow.shift) < shift_most && RootMeanSquare(slow.turn) < turn_most,
          1e3 * noise,
          1e3 * RootMeanSquare(slow.shift),
          180.0 / std::numbers::pi * RootMeanSquare(slow.turn)};
      hold.relation.clear();
      for (int t = begin; t < end; ++t) hold.relation.push_back(slow.At(t - begin, hold.anchor));
      if (!hold.about.rigid) break;
      // Remove frames from the hold in which the hand is not yet, or no longer, at its hold pose.
      const auto off = [&](int t) {
        return slow.shift.col(t - begin).norm() > 2.0 * shift_most ||
               slow.turn.col(t - begin).norm() > 2.0 * turn_most;
      };
      int from = begin, to = end;
      while (to - from > kMinHold && off(from)) ++from;
      while (to - from > kMinHold && off(to - 1)) --to;
      if (from == begin && to == end) break;
      begin = from;
      end = to;
    }
    for (int t = first; t < last; ++t) {
      if (t < begin || t >= end) holding_[t] &= static_cast<std::uint8_t>(~Bit(hand));
    }
    MakeAnchor(hold);
    holds_.push_back(std::move(hold));
  }

  // Computes the relation that the hold keeps: the robust relation with penetration resolved at
  // minimal change of the distances between hand and object.
  void MakeAnchor(Hold& hold) {
    const auto h = static_cast<std::size_t>(hold.hand);
    const HandModel& hand = *hands_[h];
    const Side side = hand.HandSide();
    const int begin = hold.about.begin, end = hold.about.end;
    hold.fingers_mean.setZero();
    for (int t = begin; t < end; ++t) hold.fingers_mean += FingersOf(clip_.pose[t], side);
    hold.fingers_mean /= end - begin;
    const int at = hold.about.rigid ? (begin + end) / 2 : begin;
    if (!hold.about.rigid) hold.fingers_mean = FingersOf(clip_.pose[at], side);
    const Isometry3d& wrist = wrists_[h][at];
    FittedHand held(hand, object_, options_);
    held.SetBody(clip_.pose[at], clip_.trans.col(at));
    held.fingers = hold.fingers_mean;
    ObjectPose pose = PoseOf(wrist * (hold.about.rigid ? hold.anchor : hold.relation.front()));
    RotationManifold manifold;
    constexpr int kRounds = 8;
    for (int round = 0; round < kRounds; ++round) {
      held.TakeHold(held.fingers, pose, false);
      held.Watch(pose, {});
      const Energies energies = held.EnergiesAt(pose);
      if (energies[EnergyTerm::kPenetration] < kClean_m * kClean_m &&
          energies[EnergyTerm::kObjectInHand] < kClean_m * kClean_m) {
        break;
      }
      ceres::Problem problem(BorrowingProblem());
      double* const q = pose.orientation.coeffs().data();
      problem.AddParameterBlock(q, 4, &manifold);
      problem.AddResidualBlock(&held.Block(), nullptr, q, pose.translation.data(),
                               held.fingers.data());
      if (held.Limits() != nullptr) {
        problem.AddResidualBlock(held.Limits(), nullptr, held.fingers.data());
      }
      ceres::Solver::Summary summary;
      ceres::Solve(FrameSolverOptions(options_), &problem, &summary);
    }
    hold.fingers = held.fingers;
    if (hold.about.rigid) hold.anchor = wrist.inverse() * pose.Transform();
    hold.at = held.InObject(pose);
  }

  // Initial values of the solve.
  void Start(std::vector<FittedFrame>& fitted) {
    Deviation world(data_, Isometry3d::Identity());
    world.shift = GaussianFilter(world.shift, 1.0);
    for (int t = 0; t < clip_.NumFrames(); ++t) {
      fitted[t].object = {Eigen::Quaterniond(data_[t].linear()).normalized(), world.shift.col(t)};
    }
    // The right hand takes precedence: where both hold, the left wrist follows.
    for (auto hold = holds_.rbegin(); hold != holds_.rend(); ++hold) {
      const auto h = static_cast<std::size_t>(hold->hand);
      for (int t = hold->about.begin; t < hold->about.end; ++t) {
        const Isometry3d& relation =
            hold->about.rigid ? hold->anchor : hold->relation[t - hold->about.begin];
        fitted[t].object = PoseOf(wrists_[h][t] * relation);
        fitted[t].hands[h].fingers =
            FingersOf(clip_.pose[t], hands_[h]->HandSide()) + (hold->fingers - hold->fingers_mean);
      }
    }
  }

  void FindRests(std::vector<FrameGoal>& goals, std::vector<FittedFrame>& fitted,
                 std::vector<RefinedRest>& rests) const {
    const int frames = clip_.NumFrames();
    for (int t = 0; t < frames; ++t) goals[t].data = PoseOf(data_[t]);
    Matrix3Xd center(3, frames);
    for (int t = 0; t < frames; ++t) center.col(t) = data_[t].translation();
    const auto reach = std::max<Eigen::Index>(1, std::lround(0.15 * clip_.frame_rate));
    const Matrix3Xd velocity = clip_.frame_rate * SlopesOverTime(center, reach);
    const double noise = WhiteNoise(center);
    const double still = kStill_m_s + 3.0 * noise * NoiseOfSlope(reach) * clip_.frame_rate;
    for (int t = 0; t < frames; ++t) {
      const auto lies = [&](int u) { return holding_[u] == 0 && velocity.col(u).norm() < still; };
      if (!lies(t)) continue;
      int end = t;
      while (end < frames && lies(end)) ++end;
      if (end - t >= kMinHold) {
        rests.push_back(AddRest(t, end, goals, fitted));
      }
      t = end;
    }
  }

  RefinedRest AddRest(int begin, int end, std::vector<FrameGoal>& goals,
                      std::vector<FittedFrame>& fitted) const {
    const int frames = clip_.NumFrames();
    Isometry3d pose = RobustMean(std::span(data_).subspan(static_cast<std::size_t>(begin),
                                                          static_cast<std::size_t>(end - begin)));
    double lowest = (pose * object_.vertices).row(2).minCoeff();
    if (std::abs(lowest) < kGround_m) {
      pose.translation().z() -= lowest;
      lowest = 0.0;
    }
    for (int t = begin; t < end; ++t) {
      goals[t].data.reset();
      goals[t].rest = PoseOf(pose);
      fitted[t].object = PoseOf(pose);
    }
    const int around = static_cast<int>(std::lround(kNearRest_s * clip_.frame_rate));
    for (int t = std::max(0, begin - around); t < std::min(frames, end + around); ++t) {
      if (t >= begin && t < end) continue;
      const Vector3d away = data_[t].translation() - pose.translation();
      if (away.head<2>().norm() < kNearRest_m) {
        goals[t].support_height = std::max(lowest, goals[t].support_height.value_or(lowest));
      }
    }
    return {begin, end, lowest};
  }

  const Clip& clip_;
  std::span<const HandModel* const> hands_;
  const FitObject& object_;
  FitOptions options_;
  std::vector<std::uint8_t> holding_;
  std::vector<Isometry3d> data_;
  std::vector<std::vector<Isometry3d>> wrists_;  // per hand and frame
  std::vector<Hold> holds_;
  std::vector<ClipHold> touched_;
  bool lies_ = false;
};

}  // namespace

FitOptions RefinementDefaults() {
  FitOptions options;
  options.lambda_object = 1000.0;
  options.lambda_fingers = 5.0;
  options.lambda_acceleration = 1e5;
  options.whole_clip = true;
  options.function_tolerance = 1e-6;
  return options;
}

Isometry3d RobustMean(std::span<const Isometry3d> poses) {
  ObjectPose mean(poses[poses.size() / 2]);
  constexpr int kRounds = 20;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> away;
    const Deviation deviation(poses, mean.Transform());
    for (Eigen::Index k = 0; k < deviation.shift.cols(); ++k) {
      away.push_back(std::hypot(deviation.shift.col(k).norm(),
                                ObjectData::kLever * deviation.turn.col(k).norm()));
    }
    const auto middle = away.begin() + static_cast<std::ptrdiff_t>(away.size() / 2);
    std::nth_element(away.begin(), middle, away.end());
    auto* const loss = new ceres::CauchyLoss(2.0 * *middle + 1e-6);
    ceres::Problem problem;
    double* const q = mean.orientation.coeffs().data();
    problem.AddParameterBlock(q, 4, new RotationManifold);
    for (const Isometry3d& pose : poses) {
      problem.AddResidualBlock(new ObjectData(ObjectPose(pose), 1.0), loss, q,
                               mean.translation.data());
    }
    const Isometry3d before = mean.Transform();
    SolveQuietly(SparseOptions(20, 1e-12), problem);
    const Isometry3d moved = before.inverse() * mean.Transform();
    if (moved.translation().norm() + LogSO3(moved.linear()).norm() < 1e-9) break;
  }
  return mean.Transform();
}

RefineResult RefineClip(const Clip& clip, std::span<const HandModel* const> hands,
                        const FitObject& object, std::span<const std::uint8_t> holding,
                        const FitOptions& options, const std::function<bool(int, int)>& progress) {
  if (!clip.object) {
    throw Error("clip", "has no object trajectory to refine",
                "Make one with 'holdfast fit', or give a clip with object_trans and object_orient");
  }
  return Refiner(clip, hands, object, holding, options).Run(progress);
}

}  // namespace holdfast
