// SPDX-License-Identifier: MIT
#include "solver/body_ik/reach_refit.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "generator/matching/capture_quality.h"
#include "generator/matching/foot_lock.h"
#include "generator/scripted/minimum_jerk.h"
#include "generator/walk_statistics/reach_faults.h"
#include "generator/wandr/intention.h"
#include "generator/wandr/motion_states.h"
#include "generator/wandr/reach_outcome.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/body_ik/arm_ik.h"
#include "solver/body_ik/foot_lift.h"
#include "solver/body_ik/frame_pose.h"
#include "solver/body_ik/reach_warp.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

constexpr int kRoomKnots = 3;            // on either side of a goal: required by WarpReach
constexpr double kMaxToes = 0.6;         // radians: maximum toe flexion in walking
constexpr double kMaxSink = 0.08;        // meters: more would be a sudden squat
constexpr double kStepClearance = 0.03;  // meters: of a foot in the middle of its step

constexpr double kFreeLean = 3.0 * kDegree, kMaxLean = 20.0 * kDegree;
constexpr double kStands = 60.0 * kDegree;  // a larger lean is lying down
constexpr int kEven = 8;                    // frames
constexpr std::array<int, 3> kSpine = {kSpine1, kSpine2, kSpine3};
constexpr std::array<double, 3> kShares = {0.4, 0.35, 0.25};

// Bends the trunk forward so that pelvis-to-neck rotates by `angle`.
void BendForward(const BodyPlacement& placed, double yaw, double angle, BodyFrame& frame) {
  const double height = placed.joints(2, kNeck) - placed.joints(2, kPelvis);
  double moved = 0.0;
  for (std::size_t k = 0; k < kSpine.size(); ++k) {
    moved += kShares[k] * (placed.joints(2, kNeck) - placed.joints(2, kSpine[k])) / height;
  }
  const Eigen::Vector3d left(std::cos(yaw), std::sin(yaw), 0.0);
  const auto turn = [&](int joint, double by) {
    const Eigen::Matrix3d& parent = placed.rotation[kJointParents[joint]];
    const Eigen::Matrix3d turned = Eigen::AngleAxisd(by, left) * placed.rotation[joint];
    frame.local[joint] =
        Eigen::Quaterniond(Eigen::Matrix3d(parent.transpose() * turned)).normalized();
  };
  for (std::size_t k = 0; k < kSpine.size(); ++k) turn(kSpine[k], kShares[k] * angle / moved);
  turn(kNeck, -angle / moved);
}

// Slows down time after an arrival, evenly until the first frame in which both feet stand, and to a
// tenth from then on: the person stops walking but does not freeze.
void ComeToRest(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles, int arrival,
                std::vector<BodyFrame>& frames) {
  constexpr double kWaiting = 0.1;
  constexpr int kEase = 4;  // minimum frames
  const int last = static_cast<int>(frames.size()) - 1;
  const std::vector<SoleBits> stands =
      FindSupports(soles.At(Place(rest_joints, frames)), wandr::kFramesPerSecond);
  int still = std::min(arrival + kEase, last);
  const auto both = [&](int t) {
    const SoleBits bits = stands[t];
    return (bits & kLeftSole) != 0 && (bits & kRightSole) != 0;
  };
  while (still < last && !both(still)) ++still;
  const double way = still - arrival, slowing = way / (0.5 * (1.0 + kWaiting));
  const std::vector<BodyFrame> before(frames.begin() + arrival, frames.end());
  for (int t = arrival + 1; t <= last; ++t) {
    const double tau = t - arrival;
    const double at = tau < slowing ? tau - 0.5 * (1.0 - kWaiting) * tau * tau / slowing
                                    : way + kWaiting * (tau - slowing);
    const auto from = std::min(static_cast<std::size_t>(at), before.size() - 2);
    frames[t] = Interpolate(before[from], before[from + 1], at - static_cast<double>(from));
  }
}

// Weight of goals on the reaching arm: full from half a second before a goal, zero a second and a
// half before.
double Reaching(std::span<const RefitGoal> goals, int t) {
  constexpr int kFree = 15, kRaise = 30;  // frames
  double reaching = 0.0;
  for (const RefitGoal& goal : goals) {
    const bool stays = goal.rests && t >= goal.frame;
    const double off = stays ? 0.0 : std::abs(goal.frame - t);
    reaching = std::max(reaching, MinimumJerk((kFree + kRaise - off) / kRaise));
  }
  return reaching;
}

// Makes arms hang and swing while walking.
void SwingArmsOnTheWay(const Eigen::Matrix3Xd& rest_joints, std::span<const RefitGoal> goals,
                       Side wrist, std::vector<BodyFrame>& frames) {
  constexpr double kWalking = 0.9;          // m/s
  constexpr int kAround = 8, kFadeIn = 20;  // frames
  const int count = static_cast<int>(frames.size());
  std::vector<Eigen::Vector2d> pelvis;
  for (const BodyFrame& frame : frames) pelvis.emplace_back(frame.pelvis.head<2>());
  for (int t = 1; t < count; ++t) {
    const int from = std::max(0, t - kAround), to = std::min(count - 1, t + kAround);
    const double way = (pelvis[to] - pelvis[from]).norm();
    const double walks = MinimumJerk(way * wandr::kFramesPerSecond / (to - from) / kWalking);
    const double begun = MinimumJerk(static_cast<double>(t) / kFadeIn);
    std::array<double, 2> idle = {begun * walks, begun * walks};
    idle[wrist == Side::kLeft ? 0 : 1] = begun * (1.0 - Reaching(goals, t));
    SwingArms(rest_joints, idle, walks, frames[t]);
  }
}

// Upward bend of the wrist per frame that keeps the fingertip off the floor; zero where none is
// needed. Smooth over time (Envelope).
std::vector<double> Bends(const std::vector<BodyFrame>& frames, const Eigen::Matrix3Xd& rest_joints,
                          int wrist, const Vector3d& tip) {
  constexpr double kClearance = 0.01;           // meters: half a finger
  constexpr double kFarthest = 70.0 * kDegree;  // maximum wrist extension
  constexpr int kReach = 4;                     // frames
  const int count = static_cast<int>(frames.size());
  std::vector<double> needed(frames.size(), 0.0);
  for (int t = 0; t < count; ++t) {
    const BodyPlacement placed = Place(rest_joints, frames[t]);
    const Vector3d hand = placed.rotation[wrist] * tip;
    const double height = placed.joints(2, wrist);
    if (height + hand.z() >= kClearance) continue;
    const double length = hand.norm();
    const double now = std::asin(std::clamp(hand.z() / length, -1.0, 1.0));
    const double wanted = std::asin(std::clamp((kClearance - height) / length, -1.0, 1.0));
    needed[t] = std::min(wanted - now, kFarthest);
  }
  return Envelope(needed, kReach);
}

// Rotates the hand up in the vertical plane of its direction.
double LiftHand(const Eigen::Matrix3Xd& rest_joints, int wrist, std::vector<BodyFrame>& frames) {
  const int knuckle = wrist == WristJoint(Side::kLeft) ? 30 : 45;
  const Vector3d tip = 1.13 * (rest_joints.col(knuckle) - rest_joints.col(wrist));
  const std::vector<double> bends = Bends(frames, rest_joints, wrist, tip);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    if (bends[t] <= 0.0) continue;
    const BodyPlacement placed = Place(rest_joints, frames[t]);
    const Eigen::Matrix3d world = placed.rotation[wrist];
    const Vector3d hand = world * tip;
    Vector3d level(hand.x(), hand.y(), 0.0);
    // A hand that hangs straight down bends to its back, so that the palm faces the floor.
    if (level.norm() < 0.2 * hand.norm()) level = world * Vector3d::UnitY();
    const Vector3d axis = level.cross(Vector3d::UnitZ());
    if (axis.norm() < 1e-6) continue;
    const Eigen::Matrix3d parent = placed.rotation[kJointParents[wrist]];
    const Eigen::AngleAxisd turn(bends[t], axis.normalized());
    frames[t].local[wrist] =
        Eigen::Quaterniond(Eigen::Matrix3d(parent.transpose() * turn * world)).normalized();
  }
  return *std::ranges::max_element(bends);
}

// Lifts swinging feet, levels toes and pins stance feet.
std::vector<FeetTarget> PinFeet(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles,
                                bool walks, std::vector<BodyFrame>& frames, RefitReport& found) {
  const std::vector<SoleBits> stands =
      FindSupports(soles.At(Place(rest_joints, frames)), wandr::kFramesPerSecond);
  if (walks) LiftFeet(rest_joints, soles, stands, frames);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    LevelToes(rest_joints, soles, FadeIn(static_cast<int>(t)), frames[t], kMaxToes);
  }
  FootLockReport lock;
  std::vector<FeetTarget> feet =
      LockFeet(rest_joints, soles, stands, frames,
               {.clearance_m = kStepClearance, .most_sink_m = kMaxSink, .keep_first = true}, &lock);
  found.max_foot_correction_m = lock.max_correction_m;
  found.max_pelvis_sink_m = lock.max_sink_m;
  return feet;
}

}  // namespace

void StraightenTrunk(const Eigen::Matrix3Xd& rest_joints, std::vector<BodyFrame>& frames) {
  const std::vector<BodyPlacement> placed = Place(rest_joints, frames);
  std::vector<double> beyond;
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const double lean = LeanBack(placed[t], Yaw(frames[t]));
    beyond.push_back(lean < kStands ? std::clamp(lean - kFreeLean, 0.0, kMaxLean) : 0.0);
  }
  const std::vector<double> bends = Envelope(beyond, kEven);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const double bend = FadeIn(static_cast<int>(t)) * bends[t];
    if (bend > 0.0) BendForward(placed[t], Yaw(frames[t]), bend, frames[t]);
  }
}

wandr::StateMatrix<double> RefitReach(const BodyMeasures& measures,
                                      const Eigen::Ref<const wandr::StateMatrix<double>>& states,
                                      std::span<const RefitGoal> goals, const RefitOptions& options,
                                      RefitReport* report) {
  const Eigen::Matrix3Xd& rest_joints = measures.rest_joints;
  const int count = static_cast<int>(states.cols());
  std::vector<BodyFrame> frames(static_cast<std::size_t>(count));
  for (int t = 0; t < count; ++t) {
    frames[t] = FrameOf(wandr::PoseOf<double>(states.col(t)), rest_joints.col(0));
  }
  const int wrist = WristJoint(options.wrist);
  const auto lacks = [&](const RefitGoal& goal) {
    const BodyPlacement placed = Place(rest_joints, frames[goal.frame]);
    return (placed.joints.col(wrist) - goal.position).norm();
  };
  const int elbow = kJointParents[wrist], shoulder = kJointParents[elbow];
  const double arm = (rest_joints.col(elbow) - rest_joints.col(shoulder)).norm() +
                     (rest_joints.col(wrist) - rest_joints.col(elbow)).norm();
  const auto in_reach = [&](const RefitGoal& goal) {
    constexpr double kTrunkGives_m = 0.05;
    const BodyPlacement placed = Place(rest_joints, frames[goal.frame]);
    const double off = (placed.joints.col(wrist) - goal.position).norm();
    return off <= options.farthest_m ||
           (off <= options.farthest_in_reach_m &&
            (placed.joints.col(shoulder) - goal.position).norm() <= arm + kTrunkGives_m);
  };
  const SolePoints soles(rest_joints, measures.sole_y);
  for (const RefitGoal& goal : goals) {
    if (goal.frame < 0 || goal.frame >= count || !goal.position.allFinite()) {
      throw Error("refit", fmt::format("goal at frame {} of {}", goal.frame, count),
                  "Give a frame of the motion and a finite position");
    }
    if (goal.rests && goal.frame + 1 < count && in_reach(goal)) {
      ComeToRest(rest_joints, soles, goal.frame, frames);
    }
  }
  std::vector<bool> reached;
  for (const RefitGoal& goal : goals) reached.push_back(in_reach(goal));
  if (options.walks) {
    StraightenTrunk(rest_joints, frames);
    SwingArmsOnTheWay(rest_joints, goals, options.wrist, frames);
  }
  RefitReport found;
  const std::vector<FeetTarget> feet =
      options.pin_feet ? PinFeet(rest_joints, soles, options.walks, frames, found)
                       : FeetOf(Place(rest_joints, frames));
  ReachWarpOptions warp_options;
  warp_options.joint_limits = CapturedJointLimits();
  warp_options.soles = &soles;
  for (const std::size_t k : {13, 14}) {
    warp_options.joint_limits[k] = std::min(warp_options.joint_limits[k], kCollarLimit);
  }
  const int margin = kRoomKnots * warp_options.knot_frames;
  for (std::size_t k = 0; k < goals.size(); ++k) {
    const RefitGoal& goal = goals[k];
    ReachWarp warp;
    warp.goal = goal.position;
    warp.frame = goal.frame;
    warp.begin = std::max(0, goal.frame - options.window_frames);
    warp.end = goal.rests ? count : std::min(count, goal.frame + options.window_frames + 1);
    warp.wrist = options.wrist;
    warp.rests = goal.rests;
    const bool room =
        warp.frame - warp.begin >= margin && (goal.rests || warp.end - 1 - warp.frame >= margin);
    if (options.place_wrist && room && (reached[k] || in_reach(goal))) {
      const std::vector<BodyFrame> before(frames.begin() + warp.begin, frames.begin() + warp.end);
      const double off = lacks(goal);
      WarpReach(rest_joints, feet, warp, warp_options, frames);
      if (lacks(goal) > off) std::ranges::copy(before, frames.begin() + warp.begin);
    }
    found.wrist_errors_m.push_back(lacks(goal));
  }
  if (options.lift_hands) {
    for (const Side side : {Side::kLeft, Side::kRight}) {
      found.max_hand_bend_rad =
          std::max(found.max_hand_bend_rad, LiftHand(rest_joints, WristJoint(side), frames));
    }
  }
  wandr::StateMatrix<double> refitted(wandr::kStateSize, count);
  for (int t = 0; t < count; ++t) {
    const BodyFrame& frame = frames[t];
    wandr::WriteState<double>(PoseOf(frame, rest_joints.col(0)), refitted.col(t));
  }
  if (report != nullptr) *report = found;
  return refitted;
}

RefitReport RefitRollout(const BodyMeasures& measures, std::span<const RefitGoal> goals, Side wrist,
                         wandr::RolloutTrack& track) {
  const int margin = kRoomKnots * ReachWarpOptions().knot_frames;
  const int last = static_cast<int>(track.states.cols()) - 1;
  std::vector<RefitGoal> timed(goals.begin(), goals.end());
  for (RefitGoal& goal : timed) {
    if (last >= 2 * margin) goal.frame = std::clamp(goal.frame, margin, last - margin);
  }
  RefitOptions options;
  options.wrist = wrist;
  options.farthest_m = 2.0 * wandr::kReachedWithin;
  options.farthest_in_reach_m = 0.6;
  RefitReport report;
  track.states =
      RefitReach(measures, track.states.cast<double>(), timed, options, &report).cast<float>();
  track.joints =
      wandr::JointsOfStates(track.states, wandr::BoneOffsetsOf(measures.rest_joints).Cast<float>());
  return report;
}

}  // namespace holdfast
