// SPDX-License-Identifier: MIT
#include "solver/actions/action_motion.h"

#include <algorithm>
#include <cmath>

#include "generator/body/limb_ik.h"
#include "generator/matching/capture_quality.h"
#include "generator/scripted/minimum_jerk.h"
#include "geometry/body/skeleton.h"
#include "geometry/rotation.h"
#include "solver/actions/action_measures.h"
#include "solver/actions/action_studio.h"
#include "solver/fit/clip_state.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/change_spline.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kKnotFrames = 5;
constexpr double kHandSigma_m = 0.012, kGazeSigma = 0.12, kLeanSigma = 0.05;

}  // namespace

void MoveActionBody(const Eigen::Matrix3Xd& rest_joints, const FeetTarget& feet,
                    const ActionScript& script, const ActionPath& path, double path_end_s,
                    std::vector<BodyFrame>& frames) {
  const UpperBodyChain chain(rest_joints, Side::kRight);
  const JointLimits limits = CapturedJointLimits();
  const auto terms_of = [&](int t) {
    const double time = t / kActionRate;
    const BodyFrame& frame = frames[t];
    const BodyPlacement placed = Place(rest_joints, frame);
    ActionFrameTerms terms;
    const PathPoint wanted = path.At(time);
    terms.hand.share = wanted.share;
    terms.hand.in_world = wanted.world.translation();
    terms.hand.in_head = wanted.head.translation();
    // A hand that is free again has no target.
    terms.hand.sigma_m = time < path_end_s ? kHandSigma_m : 1.0;
    const Isometry3d head = placed.WorldFromJoint(kHead);
    const Vector3d eyes = head * Vector3d(0.0, 0.05, 0.08);
    terms.gaze.wanted = GazeAt(script, time, eyes, wanted.At(head).translation());
    terms.gaze.sigma = kGazeSigma;
    const Matrix3d chest = LeanRotation(LeanAt(script, time)) * placed.rotation[kSpine3];
    terms.lean.up = chest.col(1);
    terms.lean.forward = chest.col(2);
    terms.lean.sigma = kLeanSigma;
    terms.balance.captured = Balance::Middle(chain, placed);
    terms.legs = LegReach::Of(chain, placed, feet);
    terms.range = JointRange::Of(chain, frame, limits);
    return terms;
  };
  const int count = static_cast<int>(frames.size());
  ChangeSpline change(count, kKnotFrames);
  ceres::Problem problem;
  change.AddTo(problem);
  for (int t = 0; t < count; ++t) {
    change.AddFrame(problem, t, [&](const Eigen::Vector4d& basis) {
      return new ActionFrameBlock(chain, frames[t], terms_of(t), basis);
    });
  }
  // The arm is already near its target.
  change.AddPrior(problem, UpperBodySigma({0.03, 0.04, 0.02}, 4.0 * kDegree, 12.0 * kDegree), 0.35);
  if (!SolveQuietly(SparseOptions(12, 1e-3), problem).IsSolutionUsable()) return;
  for (int t = 0; t < count; ++t) {
    BodyFrame& frame = frames[t];
    frame = chain.Changed(frame, change.At(t));
    PlaceLegs(rest_joints, feet, frame);
  }
}

namespace {

using Eigen::Quaterniond;

constexpr double kUsualSwivel = 0.25;
constexpr double kBackOff_m = 0.09, kBackOff_s = 0.4;

Quaterniond Relative(const Matrix3d& parent, const Matrix3d& child) {
  return Quaterniond(Matrix3d(parent.transpose() * child)).normalized();
}

// Transforms object strokes to the wrist's frame.
std::vector<Stroke> InWrist(const std::vector<Stroke>& strokes,
                            const Isometry3d& wrist_from_object) {
  std::vector<Stroke> result = strokes;
  for (Stroke& stroke : result) {
    for (Vector3d* v : {&stroke.move, &stroke.turn, &stroke.move_aside}) {
      *v = wrist_from_object.linear() * *v;
    }
    stroke.pivot = wrist_from_object * stroke.pivot;
  }
  return result;
}

// Retracted wrist before grasping or after release: backwards and off the palm.
Isometry3d BackedOff(const Isometry3d& wrist, Side side) {
  Isometry3d away = wrist;
  away.translation() -= kBackOff_m * (0.75 * PalmDirection(wrist.linear()) +
                                      0.65 * FingerDirection(side, wrist.linear()));
  return away;
}

class ActionMotionBuilder {
 public:
  ActionMotionBuilder(const ActionActor& actor, const ActionScript& script,
                      const ActionGrasp& grasp, const ActionChoice& choice,
                      const std::vector<BodyFrame>& idle)
      : actor_(actor),
        rest_joints_(actor.Measures().rest_joints),
        script_(script),
        grasp_(grasp),
        choice_(choice),
        frames_(idle),
        right_(PathOf(Side::kRight)) {
    if (script.handover) left_.emplace(PathOf(Side::kLeft));
  }

  ActionMotion Build() {
    const FeetTarget feet = FeetOf(Place(rest_joints_, frames_.front()));
    for (BodyFrame& frame : frames_) PlaceLegs(rest_joints_, feet, frame);
    RoughArm();
    ActionMotion made;
    const double end = script_.handover ? script_.handover->both_end_s : script_.duration_s + 1.0;
    MoveActionBody(rest_joints_, feet, script_, right_, end, frames_);
    ExactArm(Side::kRight, right_, made);
    if (left_) ExactArm(Side::kLeft, *left_, made);
    Hold(made);
    made.frames = std::move(frames_);
    return made;
  }

 private:
  ActionPath PathOf(Side side) const {
    const Grasp& grasp = grasp_.Of(side);
    const Isometry3d object_from_wrist = grasp.wrist_from_object.inverse();
    std::vector<PathKey> keys;
    for (int k = 0; k < static_cast<int>(script_.keys.size()); ++k) {
      if (!HoldersAt(script_, k)[side == Side::kRight ? 0 : 1]) continue;
      const ScriptKey& key = script_.keys[k];
      keys.push_back(
          {key.arrive_s, key.leave_s, key.anchor, choice_.keys[k] * object_from_wrist, key.bulge});
    }
    if (script_.handover && side == Side::kRight) {
      PathKey away = keys.back();
      away.pose = BackedOff(away.pose, side);
      away.arrive_s = away.leave_s = keys.back().leave_s + kBackOff_s;
      away.bulge.setZero();
      keys.push_back(away);
    } else if (script_.handover) {
      PathKey ready = keys.front();
      ready.pose = BackedOff(ready.pose, side);
      ready.arrive_s = script_.handover->meet_begin_s;
      ready.leave_s = std::max(ready.arrive_s, keys.front().arrive_s - kBackOff_s);
      ready.bulge.setZero();
      keys.insert(keys.begin(), ready);
    }
    return ActionPath(std::move(keys), InWrist(script_.strokes, grasp.wrist_from_object));
  }

  // Weight of the scripted path of a hand; the remainder is the idle arm's motion.
  double Share(Side side, double time) const {
    if (!script_.handover) return side == Side::kRight ? 1.0 : 0.0;
    const HandoverKey& handover = *script_.handover;
    if (side == Side::kRight) {
      const double begin = handover.both_end_s + 0.12;
      return 1.0 - MinimumJerk((time - begin) / (handover.free_s - begin));
    }
    const double end = std::max(handover.meet_begin_s + 0.3, handover.both_begin_s - 0.15);
    return MinimumJerk((time - handover.meet_begin_s) / (end - handover.meet_begin_s));
  }

  ArmTarget TargetOf(const BodyPlacement& placed, Side side, const Isometry3d& wrist) const {
    return {placed.joints.col(actor_.Arm(side).Bones().root), placed.rotation[kSpine3], wrist};
  }

  void SetArm(Side side, const BodyPlacement& placed, const ArmChoice& arm, double share,
              BodyFrame& frame) const {
    const Limb& limb = actor_.Arm(side).Bones();
    const Matrix3d& collar = placed.rotation[limb.root - 3];
    const std::array<std::pair<int, Quaterniond>, 3> turns = {
        std::pair(limb.root, Relative(collar, arm.limb.upper)),
        std::pair(limb.middle, Relative(arm.limb.upper, arm.wrist.lower)),
        std::pair(limb.end, Quaterniond(arm.wrist.wrist).normalized())};
    for (const auto& [joint, turn] : turns) {
      Quaterniond& local = frame.local[joint];
      local = share >= 1.0 ? turn : local.slerp(share, turn);
    }
  }

  // Approximate right arm on the idle trunk, as initialization of the body solver.
  void RoughArm() {
    for (std::size_t t = 0; t < frames_.size(); ++t) {
      const double time = static_cast<double>(t) / kActionRate;
      const BodyPlacement placed = Place(rest_joints_, frames_[t]);
      const Isometry3d wrist = right_.At(time).At(placed.WorldFromJoint(kHead));
      SetArm(Side::kRight, placed,
             actor_.Arm(Side::kRight).At(TargetOf(placed, Side::kRight, wrist), kUsualSwivel),
             Share(Side::kRight, time), frames_[t]);
    }
  }

  void ExactArm(Side side, const ActionPath& path, ActionMotion& made) {
    const ArmIk& arm = actor_.Arm(side);
    std::vector<BodyPlacement> placed;
    std::vector<ArmTarget> targets;
    for (std::size_t t = 0; t < frames_.size(); ++t) {
      placed.push_back(Place(rest_joints_, frames_[t]));
      const Isometry3d wrist =
          path.At(static_cast<double>(t) / kActionRate).At(placed.back().WorldFromJoint(kHead));
      targets.push_back(TargetOf(placed.back(), side, wrist));
    }
    const std::vector<double> swivels = arm.Track(targets, kActionRate);
    for (std::size_t t = 0; t < frames_.size(); ++t) {
      const double time = static_cast<double>(t) / kActionRate;
      // The style must not bend a wrist beyond its limits.
      ArmChoice chosen = arm.At(targets[t], swivels[t] + script_.swivel_rad);
      if (chosen.hand_error_rad > 0.01) chosen = arm.At(targets[t], swivels[t]);
      SetArm(side, placed[t], chosen, Share(side, time), frames_[t]);
      if (!Holds(side, time)) continue;
      made.worst_hand_error_rad = std::max(made.worst_hand_error_rad, chosen.hand_error_rad);
      made.worst_shortfall_m = std::max(made.worst_shortfall_m, chosen.shortfall_m);
    }
  }

  bool Holds(Side side, double time) const {
    if (!script_.handover) return side == Side::kRight;
    return side == Side::kRight ? time <= script_.handover->both_end_s
                                : time >= script_.handover->both_begin_s;
  }

  // The object follows the holding hand.
  void Hold(ActionMotion& made) const {
    for (std::size_t t = 0; t < frames_.size(); ++t) {
      const double time = static_cast<double>(t) / kActionRate;
      const BodyPlacement placed = Place(rest_joints_, frames_[t]);
      const bool right = Holds(Side::kRight, time), left = Holds(Side::kLeft, time);
      const Side side = right ? Side::kRight : Side::kLeft;
      made.object.push_back(placed.WorldFromJoint(WristJoint(side)) *
                            grasp_.Of(side).wrist_from_object);
      made.holding.push_back(
          static_cast<std::uint8_t>((right ? kHoldsRight : 0) | (left ? kHoldsLeft : 0)));
      std::array<double, 2> closed = {1.0, 0.0};
      if (script_.handover) {
        const HandoverKey& handover = *script_.handover;
        closed[0] = 1.0 - MinimumJerk((time - handover.both_end_s) / 0.3);
        closed[1] = MinimumJerk((time - handover.both_begin_s + 0.3) / 0.3);
      }
      made.closed.push_back(closed);
    }
  }

  const ActionActor& actor_;
  const Eigen::Matrix3Xd& rest_joints_;
  const ActionScript& script_;
  const ActionGrasp& grasp_;
  const ActionChoice& choice_;
  std::vector<BodyFrame> frames_;
  ActionPath right_;
  std::optional<ActionPath> left_;
};

}  // namespace

int FramesOf(const ActionScript& script) {
  return static_cast<int>(std::ceil(script.duration_s * kActionRate)) + 1;
}

ActionMotion MakeActionMotion(const ActionActor& actor, const ActionScript& script,
                              const ActionGrasp& grasp, const ActionChoice& choice,
                              const std::vector<BodyFrame>& idle) {
  return ActionMotionBuilder(actor, script, grasp, choice, idle).Build();
}

}  // namespace holdfast
