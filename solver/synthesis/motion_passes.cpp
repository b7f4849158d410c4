// SPDX-License-Identifier: MIT
#include "solver/synthesis/motion_passes.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "generator/body/limb_ik.h"
#include "generator/body/pose_builder.h"
#include "generator/matching/body_frame.h"
#include "generator/matching/foot_lock.h"
#include "generator/nn/random_stream.h"
#include "generator/scripted/minimum_jerk.h"
#include "generator/walk_statistics/hand_way.h"
#include "geometry/body/body_model.h"
#include "geometry/body/hand_model.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/resample.h"
#include "geometry/rotation.h"
#include "solver/body_ik/arm_ik.h"
#include "solver/synthesis/standing_life.h"
#include "solver/synthesis/synthesis.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kOffSide_rad = 20.0 * kDegree;  // deviation of a brush from its direction
constexpr double kUprightWithin = 15.0 * kDegree;

// 0 at the hand's first position, 1 where it is farthest from it, in the chest's frame.
std::vector<double> SharesOfWay(const std::vector<BodyPlacement>& placed) {
  std::vector<double> shares = HandDistances(placed);
  const double farthest = std::max(0.05, std::ranges::max(shares));  // meters
  for (double& share : shares) share = MinimumJerk(std::min(1.0, 1.15 * share / farthest));
  return shares;
}

// Rotation about the bristles, in the world, that makes a brush approach from the hand's side.
Matrix3d FromTheSide(const Isometry3d& head, const Vector3d& forward_in_world, double share) {
  const Vector3d wanted = head.linear() * Vector3d(1.0, 0.1, -0.35).normalized();
  const Eigen::AngleAxisd turn(Quaterniond::FromTwoVectors(forward_in_world, wanted));
  const double angle = std::max(0.0, turn.angle() - kOffSide_rad);
  return Eigen::AngleAxisd(share * angle, turn.axis()).toRotationMatrix();
}

// Actions that tilt a vessel.
bool Tilts(std::string_view action) {
  constexpr std::string_view kTilts[] = {"drink", "toast", "pour", "eat", "inspect"};
  return std::ranges::find(kTilts, action) != std::end(kTilts);
}

// Rotation of a vessel, in the world, that leaves it within kUprightWithin of upright.
Matrix3d ToUpright(const Vector3d& opening_in_world) {
  const Eigen::AngleAxisd turn(Quaterniond::FromTwoVectors(opening_in_world, Vector3d::UnitZ()));
  return Eigen::AngleAxisd(std::max(0.0, turn.angle() - kUprightWithin), turn.axis())
      .toRotationMatrix();
}

Quaterniond Between(const Matrix3d& parent, const Matrix3d& child) {
  return Quaterniond(Matrix3d(parent.transpose() * child)).normalized();
}

}  // namespace

void EaseArm(const ActionActor& actor, const ActionProp& prop,
             const std::optional<Vector3d>& opening, std::string_view action, double elbow_rad,
             Clip& clip) {
  const Eigen::Matrix3Xd& rest_joints = actor.Measures().rest_joints;
  std::vector<BodyFrame> frames = BodyFrames(clip, rest_joints);
  const std::vector<Isometry3d> hands = HoldingHands(rest_joints, frames, clip);
  const std::vector<BodyPlacement> placed = Place(rest_joints, frames);
  const std::vector<double> shares = SharesOfWay(placed);
  const ArmIk& arm = actor.Arm(Side::kRight);
  const Limb& limb = arm.Bones();
  std::vector<ArmTarget> targets;
  for (std::size_t t = 0; t < frames.size(); ++t) {
    Isometry3d wrist = hands[t];
    if (action == "brush") {
      const Isometry3d object = clip.object->Pose(static_cast<Eigen::Index>(t));
      const Matrix3d turn = FromTheSide(placed[t].WorldFromJoint(kHead),
                                        object.linear() * prop.marks.forward, shares[t]);
      const Vector3d bristles = object * prop.marks.tip;
      wrist.linear() = turn * wrist.linear();
      wrist.translation() = bristles + turn * (wrist.translation() - bristles);
    }
    if (opening && !Tilts(action)) {
      const Isometry3d object = clip.object->Pose(static_cast<Eigen::Index>(t));
      const Matrix3d turn = ToUpright(object.linear() * *opening);
      const Vector3d middle = object * prop.marks.middle;
      wrist.linear() = turn * wrist.linear();
      wrist.translation() = middle + turn * (wrist.translation() - middle);
    }
    targets.push_back({placed[t].joints.col(limb.root), placed[t].rotation[kSpine3], wrist});
  }
  const std::vector<double> swivels = arm.Track(targets, clip.frame_rate);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const ArmChoice chosen = arm.At(targets[t], swivels[t] + elbow_rad);
    const Matrix3d& collar = placed[t].rotation[kRightCollar];
    const auto turn = [&](int joint, const Quaterniond& to) {
      Quaterniond& local = frames[t].local[joint];
      local = local.slerp(shares[t], to);
    };
    turn(limb.root, Between(collar, chosen.limb.upper));
    turn(limb.middle, Between(chosen.limb.upper, chosen.wrist.lower));
    turn(limb.end, Quaterniond(chosen.wrist.wrist).normalized());
  }
  TakeAlong(rest_joints, frames, hands, clip);
  SetBodyFrames(frames, rest_joints, clip);
}

namespace {

constexpr double kAtRest = 0.04;        // of the maximum speed
constexpr double kComesToRest_s = 0.6;  // maximum time after arrival
// Fraction of time that keeps its pace, so that phases with a still hand are not removed.
constexpr double kAsItWas = 0.3;
constexpr double kEarly = 0.7;  // minimum jerk at time^kEarly peaks at 0.37 of the time

// The frames between two rests of the hand: first and last.
std::pair<Eigen::Index, Eigen::Index> StretchOf(const HandWay& way, const Eigen::VectorXd& steps,
                                                double rate) {
  const double at_rest = kAtRest * way.peak_m_s / rate;
  Eigen::Index begin = way.begin, end = way.arrival;
  while (begin > 0 && steps[begin - 1] > at_rest && steps[begin - 1] <= steps[begin]) --begin;
  const auto last =
      std::min<Eigen::Index>(steps.size() - 1, way.arrival + std::lround(kComesToRest_s * rate));
  while (end < last && steps[end] > at_rest && steps[end] <= steps[end - 1]) ++end;
  return {begin, end};
}

}  // namespace

void RetimeHand(const Eigen::Matrix3Xd& rest_joints, Clip& clip) {
  const std::vector<BodyFrame> body = BodyFrames(clip, rest_joints);
  const Eigen::Matrix3Xd path = HandPath(body, Place(rest_joints, body), Side::kRight);
  const HandWay way = MeasureHandWay(path, clip.frame_rate, 1);
  if (!(way.length_m > 0.0) || way.arrival - way.begin < 4) return;
  const Eigen::Index frames = path.cols();
  const Eigen::VectorXd steps =
      (path.rightCols(frames - 1) - path.leftCols(frames - 1)).colwise().norm().transpose();
  const auto [begin, end] = StretchOf(way, steps, clip.frame_rate);
  const auto count = static_cast<double>(end - begin);
  const double length = steps.segment(begin, end - begin).sum();

  // The sum of path and time fractions increases in every frame: invert it at the target values.
  std::vector<double> at;
  for (Eigen::Index t = 0; t < frames; ++t) at.push_back(static_cast<double>(t));
  Eigen::Index k = begin;
  double made = 0.0;  // at frame k
  for (Eigen::Index t = begin; t < end; ++t) {
    const double time = static_cast<double>(t - begin) / count;
    const double wanted = (1.0 - kAsItWas) * MinimumJerk(std::pow(time, kEarly)) + kAsItWas * time;
    const auto step = [&] { return (1.0 - kAsItWas) * steps[k] / length + kAsItWas / count; };
    while (k + 1 < end && made + step() < wanted) made += step(), ++k;
    at[t] = static_cast<double>(k) + std::clamp((wanted - made) / step(), 0.0, 1.0);
  }
  clip = ResampleAt(clip, at);
}

namespace {

constexpr double kStill_m = 0.02, kStill_rad = 8.0 * kDegree, kStays_s = 0.3;

// Last frame in which the right hand is still; the clip's last one if it never leaves.
int LastStill(const Eigen::Matrix3Xd& rest_joints, const Clip& clip) {
  const auto wrist = [&](int t) {
    BodyState state;
    ForwardJoints(rest_joints, clip.pose[t], clip.trans.col(t), state);
    return state.WorldFromJoint(kRightWrist);
  };
  const Eigen::Isometry3d first = wrist(0);
  int last = 0;
  for (int t = 1; t < clip.NumFrames(); ++t, ++last) {
    const Eigen::Isometry3d now = wrist(t);
    if ((now.translation() - first.translation()).norm() > kStill_m ||
        AngleBetween(now.linear(), first.linear()) > kStill_rad) {
      break;
    }
  }
  return last;
}

}  // namespace

int TrimIdle(const Eigen::Matrix3Xd& rest_joints, Clip& clip) {
  const int last = LastStill(rest_joints, clip), count = clip.NumFrames();
  const int stay = std::max(1, static_cast<int>(std::lround(kStays_s * clip.frame_rate)));
  if (last <= stay || last + 1 >= count) return 0;
  std::vector<int> frames;
  for (int k = 0; k < stay; ++k) frames.push_back(k * last / stay);
  for (int t = last; t < count; ++t) frames.push_back(t);
  clip = TakeFrames(clip, frames);
  return count - clip.NumFrames();
}

namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Quaterniond Turned(const Vector3d& axis_angle) { return Quaterniond(ExpSO3(axis_angle)); }

void Stylise(const SampleStyle& style, const Eigen::Matrix3Xd& rest_joints, double share,
             BodyFrame& frame) {
  for (const int joint : {kSpine1, kSpine2, kSpine3}) {
    frame.local[joint] = Turned(share / 3.0 * style.trunk) * frame.local[joint];
  }
  ShiftWeight(style.weight, share, frame);
  const Limb other = Arm(Side::kLeft), arm = Arm(Side::kRight);
  // The forearm of a bent elbow is in front of the belly: holding it straight ahead is unusual.
  constexpr double kTurnsIn = 30.0 * kDegree;  // beyond this exceeds captured shoulders
  const Vector3d upper = (rest_joints.col(other.middle) - rest_joints.col(other.root)).normalized();
  frame.local[other.root] =
      Turned(share * style.other_arm) * frame.local[other.root] *
      Quaterniond(Eigen::AngleAxisd(share * std::min(style.other_elbow, kTurnsIn), upper));
  frame.local[other.middle] =
      frame.local[other.middle] *
      Quaterniond(Eigen::AngleAxisd(share * style.other_elbow, other.hinge));
  // The elbow swivels about the line from shoulder to wrist; the hand is unchanged.
  const BodyPlacement placed = Place(rest_joints, frame);
  const Vector3d along = placed.joints.col(arm.end) - placed.joints.col(arm.root);
  if (along.norm() < 1e-6) return;
  const Matrix3d swing =
      Eigen::AngleAxisd(share * style.elbow, along.normalized()).toRotationMatrix();
  const Matrix3d& parent = placed.rotation[kJointParents[arm.root]];
  frame.local[arm.root] =
      Quaterniond(Matrix3d(parent.transpose() * swing * placed.rotation[arm.root])).normalized();
  const Matrix3d lower = swing * placed.rotation[arm.middle];
  frame.local[arm.end] =
      Quaterniond(Matrix3d(lower.transpose() * placed.rotation[arm.end])).normalized();
}

}  // namespace

void ShiftWeight(const Eigen::Vector2d& weight, double share, BodyFrame& frame) {
  constexpr double kRollPerMeter = 1.6;  // 4 degrees for 4.5 cm
  const Matrix3d heading = Eigen::AngleAxisd(Yaw(frame), Vector3d::UnitZ()).toRotationMatrix();
  frame.pelvis += share * (heading * Vector3d(weight.x(), -weight.y(), 0.0));
  const Vector3d ahead = heading * -Vector3d::UnitY();
  const Quaterniond roll(Eigen::AngleAxisd(share * kRollPerMeter * weight.x(), ahead));
  const Quaterniond before = frame.local[kPelvis];
  frame.local[kPelvis] = roll * before;
  frame.local[kSpine1] = before.conjugate() * roll.conjugate() * before * frame.local[kSpine1];
}

SampleStyle DrawSampleStyle(std::uint64_t seed, int sample, double amount) {
  SampleStyle style;
  if (sample == 0 || amount <= 0.0) return style;
  nn::RandomStream random(seed, 1'000'000 + static_cast<std::uint64_t>(sample));
  double drawn[10] = {};
  for (int k = 0; k < 10; k += 2) random.NormalPair(drawn[k], drawn[k + 1]);
  for (double& value : drawn) value = amount * std::clamp(value, -2.0, 2.0);
  style.pace = std::exp(0.27 * drawn[0]);
  style.trunk = kDegree * Vector3d(std::max(-4.0, 7.0 * drawn[1]), 11.0 * drawn[2], 5.0 * drawn[3]);
  style.elbow = 20.0 * kDegree * drawn[4];
  // A hanging arm: little forward, less outward.
  style.other_arm = kDegree * Vector3d(std::clamp(16.0 * drawn[5], -20.0, 14.0), 0.0,
                                       std::clamp(14.0 * drawn[6], -12.0, 10.0));
  style.other_elbow = std::min(70.0, 25.0 * std::abs(drawn[7]) * 1.4) * kDegree;
  style.weight = 0.03 * Eigen::Vector2d(drawn[8], 0.5 * drawn[9]);
  return style;
}

void ApplySampleStyle(const SampleStyle& style, const Eigen::Matrix3Xd& rest_joints, Clip& keys) {
  keys.frame_rate /= style.pace;
  std::vector<BodyFrame> frames = BodyFrames(keys, rest_joints);
  const std::vector<BodyPlacement> placed = Place(rest_joints, frames);
  const std::vector<double> distances = HandDistances(placed);
  const double farthest = std::max(0.05, std::ranges::max(distances));  // meters
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const double share = MinimumJerk(distances[t] / farthest);
    Stylise(style, rest_joints, share, frames[t]);
    if (!keys.object) continue;
    const auto frame = static_cast<Eigen::Index>(t);
    const Eigen::Isometry3d now = Place(rest_joints, frames[t]).WorldFromJoint(kRightWrist);
    keys.object->SetPose(
        frame, now * placed[t].WorldFromJoint(kRightWrist).inverse() * keys.object->Pose(frame));
  }
  SetBodyFrames(frames, rest_joints, keys);
}

namespace {

using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kSetsOut_m = 0.02;  // distance of the wrist from its first position
constexpr double kJoins_s = 0.7, kSettles_s = 0.4, kToRest_s = 1.2, kStandsAfter_s = 0.6;
constexpr double kLetsGo_s = 0.3;
constexpr double kUpright = 0.8;  // fraction of the way to an upright head and trunk
constexpr int kRightArm[] = {kRightCollar, kRightShoulder, kRightElbow, kRightWrist};

// Applies `share` of the change from `from` to `to` to `frame`.
BodyFrame WithDifference(const BodyFrame& frame, const BodyFrame& from, const BodyFrame& to,
                         double share) {
  BodyFrame out = frame;
  out.pelvis += share * (to.pelvis - from.pelvis);
  for (int j = 0; j < kNumBodyJoints; ++j) {
    const Quaterniond difference = from.local[j].conjugate() * to.local[j];
    out.local[j] = frame.local[j] * Quaterniond::Identity().slerp(share, difference);
  }
  return out;
}

// From a pose to standing, looking up; if `lets_go`, upright with hanging arms.
std::vector<BodyFrame> RestAfter(const Eigen::Matrix3Xd& rest_joints, const BodyFrame& pose,
                                 bool lets_go, double rate, std::uint64_t seed) {
  const BodyFrame hanging = Mirror(pose);  // its right arm is the mirrored left one
  const FeetTarget feet = FeetOf(Place(rest_joints, pose));
  const auto count = static_cast<std::size_t>(std::lround((kToRest_s + kStandsAfter_s) * rate));
  std::vector<BodyFrame> rest(count, pose);
  for (std::size_t k = 0; k < count; ++k) {
    const double time = static_cast<double>(k + 1) / rate, share = MinimumJerk(time / kToRest_s);
    const auto towards = [&](int joint, double part, const Quaterniond& to) {
      Quaterniond& local = rest[k].local[joint];
      local = local.slerp(part, to);
    };
    for (const int joint : {kNeck, kHead})
      towards(joint, kUpright * share, Quaterniond::Identity());
    if (!lets_go) continue;
    for (const int joint : kRightArm) towards(joint, share, hanging.local[joint]);
    // The trunk follows once the hand is off the object.
    const double trunk = kUpright * MinimumJerk(std::max(0.0, time - kLetsGo_s) / kToRest_s);
    for (const int joint : {kSpine1, kSpine2, kSpine3}) {
      towards(joint, trunk, Quaterniond::Identity());
    }
  }
  AddSway(rate, seed, rest);
  for (BodyFrame& frame : rest) PlaceLegs(rest_joints, feet, frame);
  return rest;
}

class Return {
 public:
  Return(const Eigen::Matrix3Xd& rest_joints, const Clip& clip)
      : rest_joints_(rest_joints), rate_(clip.frame_rate), frames_(BodyFrames(clip, rest_joints)) {
    for (const BodyFrame& frame : frames_) wrists_.push_back(Wrist(frame));
  }

  // Returns frames of the way back, ending at the first frame; empty if the wrist stayed.
  std::vector<BodyFrame> WayBack() const {
    const auto away = [&](std::size_t t) {
      return (wrists_[t].translation() - wrists_[0].translation()).norm();
    };
    std::size_t leaves = 0, far = 0;
    while (leaves < wrists_.size() && away(leaves) < kSetsOut_m) ++leaves;
    if (leaves == wrists_.size()) return {};
    for (std::size_t t = 0; t < wrists_.size(); ++t) far = away(t) > away(far) ? t : far;
    // The frame on the way there that is most similar to the last one.
    std::size_t join = leaves;
    for (std::size_t t = leaves; t <= far; ++t) {
      if (FromEnd(t) < FromEnd(join)) join = t;
    }
    const std::size_t until = leaves > Count(kSettles_s) ? leaves - Count(kSettles_s) : 0;
    const std::size_t count = join - until, settle = std::min(count, Count(2.0 * kSettles_s));
    std::vector<BodyFrame> back;
    for (std::size_t k = 1; k <= count; ++k) {
      const double left = 1.0 - MinimumJerk(Ratio(k, Count(kJoins_s)));
      BodyFrame frame = WithDifference(frames_[join - k], frames_[join], frames_.back(), left);
      const double settled =
          k + settle > count ? MinimumJerk(Ratio(k + settle - count, settle)) : 0.0;
      frame = WithDifference(frame, frames_[until], frames_.front(), settled);
      PlaceLegs(rest_joints_, FeetOf(Place(rest_joints_, frames_.front())), frame);
      back.push_back(frame);
    }
    return back;
  }

  Isometry3d Wrist(const BodyFrame& frame) const {
    return Place(rest_joints_, frame).WorldFromJoint(WristJoint(Side::kRight));
  }
  const std::vector<BodyFrame>& Frames() const { return frames_; }

 private:
  std::size_t Count(double seconds) const {
    return static_cast<std::size_t>(std::max(1L, std::lround(seconds * rate_)));
  }
  static double Ratio(std::size_t part, std::size_t whole) {
    return static_cast<double>(part) / static_cast<double>(whole);
  }
  double FromEnd(std::size_t t) const {
    constexpr double kMetersPerRadian = 0.15;
    return (wrists_[t].translation() - wrists_.back().translation()).norm() +
           kMetersPerRadian * AngleBetween(wrists_[t].linear(), wrists_.back().linear());
  }

  const Eigen::Matrix3Xd& rest_joints_;
  double rate_;
  std::vector<BodyFrame> frames_;
  std::vector<Isometry3d> wrists_;
};

}  // namespace

void TakeInBothHands(const Eigen::Matrix3Xd& rest_joints, const Clip& both, Clip& clip) {
  const auto pelvis = [&](const Clip& of) -> Eigen::Vector3d {
    return rest_joints.col(0) + of.trans.col(0);
  };
  // From the person of `both`, who faces -y, to this one.
  const auto heading = [](const Clip& of) {
    const Eigen::Vector3d ahead = ExpSO3(Eigen::Vector3d(of.pose[0].col(0))).col(2);
    return std::atan2(ahead.y(), ahead.x());
  };
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(heading(clip) - heading(both), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Isometry3d held = both.object->Pose(0), first = clip.object->Pose(0);
  const Eigen::Vector3d shift =
      pelvis(clip) + turn * (held.translation() - pelvis(both)) - first.translation();
  const Eigen::VectorXd away =
      (clip.object->trans.colwise() - first.translation()).colwise().norm().transpose();
  const double farthest = std::max(away.maxCoeff(), 0.02);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const double x = away(t) / farthest, share = x * x * (3.0 - 2.0 * x);
    const Eigen::Isometry3d now = clip.object->Pose(t);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = now.linear() * first.linear().transpose() * turn * held.linear();
    pose.translation() = now.translation() + (1.0 - share) * shift;
    clip.object->SetPose(t, pose);
  }
}

double FollowWithBothHands(const Eigen::Matrix3Xd& rest_joints, const Clip& both, Clip& clip) {
  BodyState state;
  ForwardJoints(rest_joints, both.pose[0], both.trans.col(0), state);
  const JointPose& arms = both.pose[0];
  const auto in_object = [&](Side side) -> Eigen::Isometry3d {
    return both.object->Pose(0).inverse() * state.WorldFromJoint(WristJoint(side));
  };
  const std::array<std::pair<Side, Eigen::Isometry3d>, 2> hands{
      std::pair{Side::kRight, in_object(Side::kRight)},
      std::pair{Side::kLeft, in_object(Side::kLeft)}};
  double most = 0.0;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    JointPose& pose = clip.pose[t];
    for (const auto& [side, object_from_wrist] : hands) {
      for (int j = WristJoint(side); j != kSpine3; j = kJointParents[j]) {
        if (kJointParents[j] != kSpine3) pose.col(j) = arms.col(j);  // all but the collar
      }
      SetFingers(pose, side, FingersOf(arms, side));
    }
    for (int round = 0; round < 3; ++round) {
      double missing = 0.0;
      for (const auto& [side, object_from_wrist] : hands) {
        const Eigen::Isometry3d wrist = clip.object->Pose(t) * object_from_wrist;
        const double off = MoveWrist(rest_joints, side, wrist.linear(), wrist.translation(),
                                     clip.trans.col(t), pose);
        if (off <= missing) continue;
        missing = off;
        ForwardJoints(rest_joints, pose, clip.trans.col(t), state);
        clip.object->trans.col(t) += state.joints.col(WristJoint(side)) - wrist.translation();
      }
      if (missing == 0.0) break;
      if (round == 2) most = std::max(most, missing);
    }
  }
  clip.holding_hand.assign(clip.pose.size(), kHoldsRight | kHoldsLeft);
  return most;
}

void AddReturn(const Eigen::Matrix3Xd& rest_joints, bool lets_go, std::uint64_t seed, Clip& clip) {
  const Return way(rest_joints, clip);
  const std::vector<BodyFrame> back = way.WayBack();
  if (back.empty()) return;
  const Isometry3d first = clip.object->Pose(0);
  const Isometry3d wrist_from_object =
      way.Wrist(way.Frames().back()).inverse() * clip.object->Pose(clip.NumFrames() - 1);
  const std::vector<BodyFrame> rest =
      RestAfter(rest_joints, way.Frames().front(), lets_go, clip.frame_rate, seed);
  std::vector<BodyFrame> all = way.Frames();
  all.insert(all.end(), back.begin(), back.end());
  all.insert(all.end(), rest.begin(), rest.end());

  const Eigen::Index before = clip.NumFrames();
  const Eigen::Index held = before + static_cast<Eigen::Index>(back.size());
  const auto count = static_cast<Eigen::Index>(all.size());
  clip.trans.conservativeResize(3, count);
  clip.object->trans.conservativeResize(3, count);
  clip.object->orient.conservativeResize(3, count);
  clip.pose.resize(all.size(), clip.pose.back());
  clip.holding_hand.resize(all.size(), clip.holding_hand.back());
  const JointPose at_ease = MirrorPose(clip.pose.front());  // right fingers as the left ones
  for (Eigen::Index t = before; t < count; ++t) {
    const std::size_t frame = static_cast<std::size_t>(t);
    clip.pose[frame] = clip.pose[frame - 1];  // unwrapped from the previous frame
    // The object is put exactly where it was: the grasp may have slipped slightly.
    const bool at_first = lets_go ? t >= held - 1 : t == held - 1;
    clip.object->SetPose(t, at_first ? first : way.Wrist(all[frame]) * wrist_from_object);
    if (t < held || !lets_go) continue;
    clip.holding_hand[frame] = 0;
    const double opened = MinimumJerk(static_cast<double>(t - held + 1) / (0.5 * clip.frame_rate));
    const auto& fingers = clip.pose[static_cast<std::size_t>(held) - 1];
    clip.pose[frame].rightCols<15>() =
        (1.0 - opened) * fingers.rightCols<15>() + opened * at_ease.rightCols<15>();
  }
  SetBodyFrames(all, rest_joints, clip);
}

void StayAboveTable(const Eigen::Matrix3Xd& rest_joints, const TriangleMesh& object, double table_m,
                    Clip& clip) {
  constexpr double kNear_m = 0.4, kFinger_m = 0.012, kAbout_s = 0.15;
  const int frames = clip.NumFrames();
  const Vector3d first = clip.object->trans.col(0);
  Eigen::VectorXd sunk = Eigen::VectorXd::Zero(frames);
  double first_hand = 0.0;  // a hand may reach as low as where it takes the object
  int last = 0;             // frame with the object in the hand
  BodyState state;
  for (int t = 0; t < frames; ++t) {
    const Vector3d from_first = clip.object->trans.col(t) - first;
    if ((clip.holding_hand[t] & kHoldsRight) == 0 || from_first.head<2>().norm() > kNear_m)
      continue;
    ForwardJoints(rest_joints, clip.pose[t], clip.trans.col(t), state);
    const double object_low = (clip.object->Pose(t) * object.vertices).row(2).minCoeff();
    const double hand_low =
        state.joints.row(2).segment<kJointsPerHand>(HandBegin(Side::kRight)).minCoeff() - kFinger_m;
    if (t == 0) first_hand = hand_low;
    sunk(t) = std::max({0.0, table_m - object_low, std::min(table_m, first_hand) - hand_low});
    last = t;
  }
  // The maximum around each frame, averaged over the same time: never less than needed, except
  // where the object leaves the table and returns.
  const int about = std::max(1, static_cast<int>(std::lround(kAbout_s * clip.frame_rate)));
  const auto around = [&](const Eigen::VectorXd& of, int t) {
    const int begin = std::max(0, t - about), end = std::min(frames, t + about + 1);
    return of.segment(begin, end - begin);
  };
  Eigen::VectorXd most(frames);
  for (int t = 0; t < frames; ++t) most(t) = around(sunk, t).maxCoeff();
  for (int t = 0; t < frames; ++t) {
    const double from_table = std::min(1.0, static_cast<double>(std::min(t, last - t)) / about);
    const double up = around(most, t).mean() * MinimumJerk(from_table);
    if (!(up > 0.0) || (clip.holding_hand[t] & kHoldsRight) == 0) continue;
    ForwardJoints(rest_joints, clip.pose[t], clip.trans.col(t), state);
    const Isometry3d wrist = state.WorldFromJoint(kRightWrist);
    MoveWrist(rest_joints, Side::kRight, wrist.linear(),
              wrist.translation() + up * Vector3d::UnitZ(), clip.trans.col(t), clip.pose[t]);
    ForwardJoints(rest_joints, clip.pose[t], clip.trans.col(t), state);
    const Isometry3d now = state.WorldFromJoint(kRightWrist);
    clip.object->SetPose(t, now * wrist.inverse() * clip.object->Pose(t));
  }
}

void AddRest(const Eigen::Matrix3Xd& rest_joints, std::uint64_t seed, Clip& clip) {
  std::vector<BodyFrame> frames = BodyFrames(clip, rest_joints);
  const std::vector<BodyFrame> rest =
      RestAfter(rest_joints, frames.back(), false, clip.frame_rate, seed);
  const BodyFrame last = frames.back();
  frames.insert(frames.end(), rest.begin(), rest.end());
  std::vector<double> at(frames.size(), clip.NumFrames() - 1.0);
  std::iota(at.begin(), at.begin() + clip.NumFrames(), 0.0);
  clip = ResampleAt(clip, at);
  std::vector<BodyFrame> held = frames;
  std::fill(held.end() - static_cast<std::ptrdiff_t>(rest.size()), held.end(), last);
  TakeAlong(rest_joints, frames, HoldingHands(rest_joints, held, clip), clip);
  SetBodyFrames(frames, rest_joints, clip);
}

}  // namespace holdfast
