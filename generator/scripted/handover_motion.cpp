// SPDX-License-Identifier: MIT
#include "generator/scripted/handover_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "generator/body/limb_ik.h"
#include "generator/body/pose_builder.h"
#include "generator/nn/random_stream.h"
#include "generator/scripted/minimum_jerk.h"
#include "geometry/body/skeleton.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "geometry/seed.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::array<Side, 2> kSides = {Side::kRight, Side::kLeft};

std::size_t Index(Side side) { return side == Side::kRight ? 0 : 1; }
// The right hand is on the -x side of a person who faces -y.
double Outward(Side side) { return side == Side::kRight ? -1.0 : 1.0; }

bool Coin(RandomDraws& draws) { return draws.Uniform(0.0, 1.0) < 0.5; }

Vector3d Normal3(RandomDraws& draws, double sigma) {
  const double x = draws.Normal(), y = draws.Normal(), z = draws.Normal();
  return sigma * Vector3d(x, y, z);
}

Vector3d InBox(RandomDraws& draws, const Vector3d& low, const Vector3d& high) {
  const double x = draws.Uniform(low.x(), high.x()), y = draws.Uniform(low.y(), high.y());
  return {x, y, draws.Uniform(low.z(), high.z())};
}

// Hand orientation for taking an offered object: fingers forward and slightly inwards, thumb up.
Matrix3d OfferedHand(Side side) {
  return HandOrientation(side, Vector3d(-0.5 * Outward(side), -1.0, 0.05), Vector3d::UnitZ());
}

struct HandKey {
  double time_s;
  Isometry3d wrist;
  bool rest;
};

// Path of one hand: position, and rotation relative to its offered orientation.
class HandPath {
 public:
  HandPath(Side side, const std::vector<HandKey>& keys)
      : reference_(OfferedHand(side)), spline_(Waypoints(keys)) {}

  Isometry3d Wrist(double time) const {
    const Eigen::VectorXd v = spline_.Value(time);
    return RigidTransform(reference_ * ExpSO3(v.segment<3>(3)), v.head<3>());
  }

 private:
  std::vector<Waypoint> Waypoints(const std::vector<HandKey>& keys) const {
    std::vector<Waypoint> waypoints;
    Vector3d turn = Vector3d::Zero();
    for (const HandKey& key : keys) {
      turn = UnwrapAxisAngle(LogSO3(reference_.transpose() * key.wrist.linear()), turn);
      Eigen::VectorXd value(6);
      value << key.wrist.translation(), turn;
      waypoints.push_back({key.time_s, value, key.rest});
    }
    return waypoints;
  }

  Matrix3d reference_;
  MinimumJerkSpline spline_;
};

constexpr double kIdleClosure = 0.3;

struct Dwell {
  double begin_s, end_s;
};

// Plan of events, made before any joint moves.
struct Script {
  Side first_hand = Side::kRight;
  std::array<std::vector<HandKey>, 2> keys;
  std::array<std::vector<Waypoint>, 2> closure;  // 0 open, 1 holding
  std::vector<ReachKey> attention;  // key poses of the holding hand; trunk and gaze follow it
  std::vector<Dwell> dwells;
  double end_s = 0.0;
};

class HandoverWriter {
 public:
  HandoverWriter(const BodyMeasures& body, const HandoverGrasps& grasps,
                 const HandoverOptions& options)
      : body_(body), grasps_(grasps), options_(options), draw_(options.seed) {
    // Heights above the ground of this person.
    const auto height = [&](int joint) { return body.rest_joints(1, joint) - body.sole_y; };
    hip_ = height(0);
    chest_ = height(kSpine3);
    shoulder_x_ = std::abs(body.rest_joints(0, Arm(Side::kRight).root) - body.rest_joints(0, 0));
    arm_ = MaxReach(body.rest_joints, Arm(Side::kRight));
  }

  Script Write() {
    script_.first_hand = options_.first_hand.value_or(Coin(draw_) ? Side::kRight : Side::kLeft);
    int switches = options_.switches;
    if (switches == 0) switches = 1 + static_cast<int>(draw_.Uniform(0.0, 3.0));
    Side holder = script_.first_hand;
    Add(holder, 0.0, Carried(holder));
    Add(OtherSide(holder), 0.0, Idle(OtherSide(holder)));
    Close(holder, 0.0, 1.0);
    Close(OtherSide(holder), 0.0, kIdleClosure);
    for (int k = 0; k < switches; ++k) {
      CarryOn(holder, 2);
      PassOn(holder);
      holder = OtherSide(holder);
    }
    CarryOn(holder, 1);
    Add(holder, Now(holder) + draw_.Uniform(0.5, 1.0), Carried(holder));
    script_.end_s = std::max(Now(Side::kRight), Now(Side::kLeft)) + draw_.Uniform(0.1, 0.4);
    for (const HandKey& key : script_.keys[Index(holder)]) {
      if (script_.dwells.empty() || key.time_s > script_.dwells.back().end_s) Attend(holder, key);
    }
    return std::move(script_);
  }

 private:
  double Now(Side side) const { return script_.keys[Index(side)].back().time_s; }

  void Add(Side side, double time, const Isometry3d& wrist, bool rest = true) {
    script_.keys[Index(side)].push_back({time, wrist, rest});
  }

  void Close(Side side, double time, double closure) {
    script_.closure[Index(side)].push_back({time, Eigen::VectorXd::Constant(1, closure), true});
  }

  void Attend(Side side, const HandKey& key) {
    ReachKey attention;
    attention.time_s = key.time_s;
    attention.wrist = key.wrist.translation();
    attention.hand = key.wrist.linear();
    attention.rest = key.rest;
    const double towards = std::atan2(attention.wrist.x(), -attention.wrist.y());
    attention.torso_twist_rad = 0.25 * towards;
    attention.torso_lean_rad = 0.06;
    attention.weight_shift = 0.3 * Outward(side);
    script_.attention.push_back(attention);
  }

  Isometry3d Pose(Side side, const Vector3d& wrist, double turn_rad) {
    return RigidTransform(OfferedHand(side) * ExpSO3(Normal3(draw_, turn_rad)), wrist);
  }

  // A random pose in front of the hand's own side of the body.
  Isometry3d Carried(Side side) {
    const Vector3d wrist =
        InBox(draw_, Vector3d(0.6 * shoulder_x_, -0.85 * arm_, hip_ + 0.10 * arm_),
              Vector3d(2.0 * shoulder_x_, -0.50 * arm_, chest_ + 0.25 * arm_));
    return Pose(side, {Outward(side) * wrist.x(), wrist.y(), wrist.z()}, 12.0 * kDegree);
  }

  // Hangs at the side, or waits bent in front of the waist: near the object but not at it.
  Isometry3d Idle(Side side) {
    if (draw_.Uniform(0.0, 1.0) < 0.35) {
      const Vector3d wrist(Outward(side) * draw_.Uniform(1.2, 1.7) * shoulder_x_,
                           -draw_.Uniform(0.40, 0.55) * arm_, hip_ + 0.12 * arm_);
      return Pose(side, wrist, 8.0 * kDegree);
    }
    Isometry3d pose = Isometry3d::Identity();
    pose.linear() = HandOrientation(side, Vector3d(0.0, -0.25, -1.0), -Vector3d::UnitY());
    pose.translation() = Vector3d(Outward(side) * (shoulder_x_ + draw_.Uniform(0.06, 0.12)),
                                  -draw_.Uniform(0.03, 0.10), hip_ - 0.10 * arm_);
    return pose;
  }

  void CarryOn(Side side, int most) {
    const int count = static_cast<int>(draw_.Uniform(0.0, most + 1.0));
    for (int k = 0; k < count; ++k) {
      Add(side, Now(side) + draw_.Uniform(0.5, 1.1), Carried(side), Coin(draw_));
    }
  }

  void PassOn(Side giver) {
    const Side receiver = OtherSide(giver);
    // Object pose at the meeting, and its drift while both hands hold it.
    Isometry3d met = Isometry3d::Identity();
    met.linear() = ExpSO3(draw_.Normal() * 8.0 * kDegree * Vector3d::UnitZ()) * grasps_.presented;
    met.translation() = InBox(draw_, Vector3d(-0.10, -0.78 * arm_, hip_ + 0.25 * arm_),
                              Vector3d(0.10, -0.62 * arm_, chest_ + 0.10 * arm_));
    Isometry3d left = met;
    left.translation() += Normal3(draw_, 0.015);

    const double approach = draw_.Uniform(0.45, 0.9);
    const double arrives = Now(giver) + draw_.Uniform(0.5, 1.0);
    const double begin = std::max(arrives + std::max(0.0, draw_.Uniform(-0.2, 0.3)),
                                  Now(receiver) + approach + 0.05);
    const double end = begin + draw_.Uniform(options_.min_dwell_s, options_.max_dwell_s);
    const auto wrist = [&](Side side, const Isometry3d& object) -> Isometry3d {
      return object * grasps_.Of(side).wrist_from_object.inverse();
    };
    const HandKey waiting = script_.keys[Index(receiver)].back();
    if (begin - approach > waiting.time_s) Add(receiver, begin - approach, waiting.wrist);
    Add(receiver, begin, wrist(receiver, met));
    if (begin > arrives + 1e-3) Add(giver, arrives, wrist(giver, met));
    Add(giver, begin, wrist(giver, met));
    Add(giver, end, wrist(giver, left));
    Add(receiver, end, wrist(receiver, left));
    Close(receiver, begin - 0.9 * approach, kIdleClosure);
    Close(receiver, begin - 0.3 * approach, 0.0);
    Close(receiver, begin, 1.0);
    script_.dwells.push_back({begin, end});
    for (const HandKey& key : script_.keys[Index(giver)]) {
      const double after = script_.attention.empty() ? -1.0 : script_.attention.back().time_s;
      if (key.time_s > after) Attend(giver, key);
    }
    const double retreat = draw_.Uniform(0.45, 0.9);
    Add(giver, end + retreat, Idle(giver));
    Close(giver, end, 1.0);
    Close(giver, end + 0.3 * retreat, 0.0);
    Close(giver, end + 0.9 * retreat, kIdleClosure);
    const double lag = draw_.Uniform(-0.15, 0.25);
    if (lag > 0.0) Add(receiver, end + lag, wrist(receiver, left));
    Add(receiver, Now(receiver) + draw_.Uniform(0.5, 1.0), Carried(receiver), Coin(draw_));
  }

  const BodyMeasures& body_;
  const HandoverGrasps& grasps_;
  const HandoverOptions& options_;
  RandomDraws draw_;
  Script script_;
  double hip_, chest_, shoulder_x_, arm_;
};

// Solves an arm of a standing person for a hand pose of the script. Returns whether the hand
// reaches it.
bool PoseArm(const Eigen::Matrix3Xd& rest_joints, const HandoverGrasp& grasp, Side side,
             const Isometry3d& wrist, double closure, PoseBuilder& pose) {
  const Limb arm = Arm(side);
  const double sign = -Outward(side);
  const Matrix3d chest = pose.World(kSpine3);
  // The collarbone moves along with an arm that reaches forward.
  const double extent = std::min(
      1.0, (wrist.translation() - pose.Position(arm.root)).norm() / MaxReach(rest_joints, arm));
  const double forward = std::max(0.0, -wrist.translation().y()) * extent;
  pose.SetLocal(arm.root - 3, ExpSO3(Vector3d(0.0, sign * 0.25 * forward, sign * 0.06)));

  // The elbow hangs, and moves to where the forearm would keep the wrist straight.
  const Vector3d shoulder = pose.Position(arm.root);
  const Vector3d straight =
      wrist.translation() - 0.25 * FingerDirection(side, wrist.linear()) - shoulder;
  const Vector3d pole = chest * Vector3d(-0.35 * sign, -1.0, -0.25) + 2.0 * straight;
  const LimbPose limb = SolveLimb(rest_joints, arm, shoulder, wrist.translation(), pole);
  const WristPose hand = SolveWrist(rest_joints, side, limb.lower, wrist.linear());
  pose.SetWorld(arm.root, limb.upper);
  pose.SetWorld(arm.middle, hand.lower);
  pose.SetLocal(arm.end, hand.wrist);

  const FingerPose open = GraspingFingers(rest_joints, side, 0.0);
  pose.SetFingers(side, open + closure * (grasp.fingers - open));
  return limb.reached && hand.reached;
}

// Returns nullopt if a hand misses its target while both hands hold.
std::optional<HandoverMotion> Perform(const BodyMeasures& body, const HandoverGrasps& grasps,
                                      const HandoverOptions& options, const Script& script) {
  ScriptedReachOptions reach;
  reach.frame_rate = options.frame_rate;
  reach.duration_s = script.end_s;
  reach.seed = options.seed;
  HandoverMotion motion;
  motion.clip = MakeReachMotion(body, script.attention, reach);
  motion.first_hand = script.first_hand;
  Clip& clip = motion.clip;
  const int frames = clip.NumFrames();
  for (const Dwell& dwell : script.dwells) {
    const double middle = 0.5 * (dwell.begin_s + dwell.end_s);
    motion.switch_frames.push_back(static_cast<int>(std::lround(middle * options.frame_rate)));
  }

  std::array<std::optional<HandPath>, 2> path;
  std::array<std::optional<MinimumJerkSpline>, 2> closure;
  for (const Side side : kSides) {
    path[Index(side)].emplace(side, script.keys[Index(side)]);
    closure[Index(side)].emplace(script.closure[Index(side)]);
  }
  ObjectTrack& object = clip.object.emplace();
  object.trans.resize(3, frames);
  object.orient.setZero(3, frames);
  JointPose previous = clip.pose.front();
  Side holder = script.first_hand;
  std::size_t next = 0;  // next or current dwell
  for (int t = 0; t < frames; ++t) {
    const double time = t / options.frame_rate;
    if (next < script.dwells.size() && time > script.dwells[next].end_s) {
      holder = OtherSide(holder);
      ++next;
    }
    const bool both = next < script.dwells.size() && time >= script.dwells[next].begin_s;

    PoseBuilder pose(body.rest_joints, clip.trans.col(t) + body.rest_joints.col(0));
    for (int j = 0; j < kNumJoints; ++j) pose.SetLocal(j, ExpSO3(clip.pose[t].col(j)));
    bool reached = true;
    for (const Side side : kSides) {
      const double closed = std::clamp(closure[Index(side)]->Value(time)[0], 0.0, 1.0);
      reached &= PoseArm(body.rest_joints, grasps.Of(side), side, path[Index(side)]->Wrist(time),
                         closed, pose);
    }
    if (both && !reached) return std::nullopt;
    clip.pose[t] = previous = pose.Pose(previous);

    const int wrist = WristJoint(holder);
    object.SetPose(t, RigidTransform(pose.World(wrist), pose.Position(wrist)) *
                          grasps.Of(holder).wrist_from_object);
    const std::uint8_t bit = holder == Side::kRight ? kHoldsRight : kHoldsLeft;
    clip.holding_hand.push_back(both ? kHoldsRight | kHoldsLeft : bit);
  }
  return motion;
}

}  // namespace

HandoverGrasps PalmGrasps(const BodyMeasures& body, const Eigen::Matrix3Xd& object_vertices,
                          std::uint64_t seed) {
  if (object_vertices.cols() == 0) {
    throw Error("handover", "the object has no vertices", "Give a mesh");
  }
  constexpr double kPalmThickness = 0.016;  // from the middle of the hand to its skin, meters
  RandomDraws draw(seed ^ 0x6772697073ULL);
  HandoverGrasps grasps;
  grasps.presented = ExpSO3(draw.Uniform(-std::numbers::pi, std::numbers::pi) * Vector3d::UnitZ()) *
                     ExpSO3(Normal3(draw, 6.0 * kDegree));
  const Eigen::Matrix3Xd presented = grasps.presented * object_vertices;
  for (const Side side : kSides) {
    const Matrix3d hand = OfferedHand(side) * ExpSO3(Normal3(draw, 6.0 * kDegree));
    const Vector3d palm = PalmDirection(hand);
    Eigen::Index outermost;
    (-palm.transpose() * presented).maxCoeff(&outermost);
    const int wrist = WristJoint(side);
    const Vector3d knuckle =
        body.rest_joints.col(HandBegin(side) + 3) - body.rest_joints.col(wrist);
    const Vector3d palm_in_wrist = 0.85 * knuckle + kPalmThickness * -Vector3d::UnitY();
    // The middle of the palm lies on the outermost point of the object.
    HandoverGrasp& grasp = grasps.Of(side);
    grasp.wrist_from_object = PoseAt(hand, palm_in_wrist, presented.col(outermost)).inverse() *
                              RigidTransform(grasps.presented, Vector3d::Zero());
    const double thickness =
        (palm.transpose() * presented).maxCoeff() - (palm.transpose() * presented).minCoeff();
    grasp.fingers =
        GraspingFingers(body.rest_joints, side, std::clamp(1.1 - 6.0 * thickness, 0.2, 1.0));
  }
  return grasps;
}

HandoverMotion MakeHandoverMotion(const BodyMeasures& body, const HandoverGrasps& grasps,
                                  const HandoverOptions& options) {
  if (options.switches < 0 || options.switches > 20) {
    throw Error("handover", fmt::format("{} switches", options.switches), "Request 0 to 20");
  }
  if (!(options.min_dwell_s >= 0.0 && options.max_dwell_s >= options.min_dwell_s)) {
    throw Error("handover", "the range of dwell times is empty or negative", "Use 0.1 to 0.5 s");
  }
  if (!(options.frame_rate > 0.0)) {
    throw Error("handover", "the frame rate is not positive", "Use 30, for example");
  }
  constexpr int kAttempts = 40;
  HandoverOptions drawn = options;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    drawn.seed = options.seed + kSplitMixStep * static_cast<std::uint64_t>(attempt);
    const Script script = HandoverWriter(body, grasps, drawn).Write();
    std::optional<HandoverMotion> motion = Perform(body, grasps, drawn, script);
    if (motion) return *std::move(motion);
  }
  throw Error("handover", "the hands cannot meet with these grasps within the wrists' range",
              "Turn the object, or hold it differently");
}

void AddNoise(Clip& clip, const ClipNoise& noise, std::uint64_t seed) {
  RandomDraws draw(seed ^ 0x6e6f697365ULL);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    for (int j = 0; j < kNumJoints && noise.joint_rad > 0.0; ++j) {
      if (j >= kNumBodyJoints && j < kLeftHandBegin) continue;  // jaw and eyes
      const Matrix3d disturbed =
          ExpSO3(clip.pose[t].col(j)) * ExpSO3(Normal3(draw, noise.joint_rad));
      clip.pose[t].col(j) = UnwrapAxisAngle(LogSO3(disturbed), clip.pose[t].col(j));
    }
    if (!clip.object) continue;
    clip.object->trans.col(t) += Normal3(draw, noise.object_m);
    const Vector3d orient = clip.object->orient.col(t);
    clip.object->orient.col(t) =
        UnwrapAxisAngle(LogSO3(ExpSO3(Normal3(draw, noise.object_rad)) * ExpSO3(orient)), orient);
  }
}

}  // namespace holdfast
