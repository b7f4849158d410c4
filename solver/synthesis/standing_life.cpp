// SPDX-License-Identifier: MIT
#include "solver/synthesis/standing_life.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "generator/body/limb_ik.h"
#include "generator/matching/foot_lock.h"
#include "generator/nn/random_stream.h"
#include "generator/scripted/minimum_jerk.h"
#include "geometry/body/skeleton.h"
#include "geometry/rotation.h"
#include "solver/synthesis/motion_passes.h"
#include "solver/synthesis/synthesis.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kTwoPi = 2.0 * std::numbers::pi;

// Sum of incommensurate sines: root mean square 1, value 0 at time 0.
class Wave {
 public:
  Wave(double fall, RandomDraws& draws) {
    double power = 0.0;
    for (std::size_t k = 0; k < kHertz.size(); ++k) {
      hertz_[k] = kHertz[k] * draws.Uniform(0.8, 1.25);
      phase_[k] = draws.Uniform(0.0, kTwoPi);
      amount_[k] = std::pow(kHertz[k], -fall);
      power += 0.5 * amount_[k] * amount_[k];
    }
    for (double& amount : amount_) amount /= std::sqrt(power);
  }
  double operator()(double time) const { return Sum(time) - Sum(0.0); }

 private:
  double Sum(double time) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < kHertz.size(); ++k) {
      sum += amount_[k] * std::sin(kTwoPi * hertz_[k] * time + phase_[k]);
    }
    return sum;
  }
  static constexpr std::array<double, 4> kHertz = {0.3, 0.6, 1.2, 2.2};
  std::array<double, 4> hertz_{}, phase_{}, amount_{};
};

// Captured sway of a joint: RMS angle per axis, degrees, and the falloff of its sines with
// frequency (0.4: 0.9 Hz on average, 0.9: 0.6 Hz).
struct Idle {
  int joint;
  std::array<double, 3> degrees;
  double fall;
};
constexpr Idle kIdle[] = {
    {kPelvis, {0.33, 0.44, 0.12}, 0.4},
    {kSpine1, {0.12, 0.12, 0.11}, 0.4},
    {kSpine2, {0.12, 0.12, 0.11}, 0.4},
    {kSpine3, {0.24, 0.12, 0.11}, 0.4},
    {kNeck, {0.8, 0.6, 0.4}, 0.9},
    {kHead, {1.1, 0.7, 0.5}, 0.9},
    {kLeftCollar, {0.02, 0.13, 0.30}, 0.4},
    {kRightCollar, {0.02, 0.13, 0.30}, 0.4},
    {kLeftShoulder, {0.74, 0.36, 0.36}, 0.4},
    {kRightShoulder, {0.37, 0.18, 0.18}, 0.4},
    {kLeftElbow, {0.48, 0.40, 0.16}, 0.4},
    {kRightElbow, {0.24, 0.20, 0.08}, 0.4},
    {kLeftWrist, {0.50, 0.37, 0.40}, 0.4},
};
constexpr double kPelvis_m = 0.002, kBreath_degrees = 0.5, kBreath_hertz = 0.26;

// Rotations that are taken and given up again, with random times and amounts.
class Turns {
 public:
  Turns() = default;
  Turns(double begin_s, double end_s, double gap_s, const Vector3d& most, RandomDraws& draws) {
    double at = begin_s + draws.Uniform(-0.2, 0.3);
    for (int k = 0; at < end_s; ++k) {
      const double share = k % 2 == 0 ? 1.0 : 0.25;  // away, then nearly back
      Vector3d to;
      for (int i = 0; i < 3; ++i) to[i] = share * most[i] * draws.Uniform(-1.0, 1.0);
      // Enforce a visible amplitude.
      if (k % 2 == 0 && std::abs(to.y()) < 0.5 * most.y()) {
        to.y() = std::copysign(0.5 * most.y(), to.y());
      }
      Add(at, draws.Uniform(0.55, 0.9) * std::min(1.5, std::max(0.8, gap_s)), to);
      at += gap_s * draws.Uniform(0.7, 1.4);
    }
  }
  void Add(double at_s, double takes_s, const Vector3d& to) {
    turns_.push_back({at_s, takes_s, to - last_});
    last_ = to;
  }
  const Vector3d& Last() const { return last_; }
  Vector3d At(double time) const {
    Vector3d sum = Vector3d::Zero();
    for (const Turn& turn : turns_) {
      sum += MinimumJerk(std::clamp((time - turn.at_s) / turn.takes_s, 0.0, 1.0)) * turn.by;
    }
    return sum;
  }

 private:
  struct Turn {
    double at_s, takes_s;
    Vector3d by;
  };
  std::vector<Turn> turns_;
  Vector3d last_ = Vector3d::Zero();
};

// Maxima in degrees: nod, turn and tilt of the head; lean, turn and bend of the trunk.
struct Part {
  std::string_view action;
  Vector3d head, trunk;
};

Part PartOf(std::string_view action) {
  const Part parts[] = {
      {"call", {5, 11, 4}, {2, 6, 2}},    {"takepicture", {2, 3, 2}, {3, 11, 1.5}},
      {"pass", {6, 10, 3}, {3, 5, 1.5}},  {"switchON", {6, 12, 3}, {2, 9, 1.5}},
      {"lift", {5, 10, 3}, {2, 4, 1.5}},  {"inspect", {3, 6, 5}, {2, 4, 1.5}},
      {"pour", {4, 6, 4}, {2.5, 3, 1.5}}, {"drink", {1, 3, 2}, {2, 5, 1.5}},
      {"eat", {2, 5, 2}, {2, 5, 1.5}},    {"toast", {1, 4, 2}, {2, 5, 1.5}},
      {"brush", {2, 4, 4}, {2, 4, 2}},
  };
  const auto found = std::ranges::find(parts, action, &Part::action);
  return found != std::end(parts) ? *found : Part{action, {2, 4, 2}, {1, 2, 1}};
}

// Time in seconds at which the right hand has covered most of its path, in the chest's frame.
double Arrives(const std::vector<BodyPlacement>& placed, double rate) {
  const std::vector<double> distances = HandDistances(placed);
  const double farthest = std::ranges::max(distances);
  std::size_t t = 0;
  while (t + 1 < distances.size() && distances[t] < 0.85 * farthest) ++t;
  return static_cast<double>(t) / rate;
}

Quaterniond TurnOf(const Vector3d& degrees) { return Quaterniond(ExpSO3(kDegree * degrees)); }

}  // namespace

void AddSway(double frame_rate, std::uint64_t seed, std::vector<BodyFrame>& frames) {
  RandomDraws draws(seed);
  const Wave left(0.9, draws), ahead(0.9, draws);
  const Eigen::AngleAxisd heading(Yaw(frames.front()), Vector3d::UnitZ());
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const double time = static_cast<double>(t) / frame_rate;
    frames[t].pelvis += kPelvis_m * (heading * Vector3d(left(time), ahead(time), 0.0));
  }
  const double breath = draws.Uniform(0.0, kTwoPi);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const double phase = kTwoPi * kBreath_hertz * static_cast<double>(t) / frame_rate + breath;
    Quaterniond& chest = frames[t].local[kSpine3];
    chest = chest * TurnOf({-kBreath_degrees * (std::sin(phase) - std::sin(breath)), 0.0, 0.0});
  }
  for (const Idle& idle : kIdle) {
    const Wave waves[3] = {{idle.fall, draws}, {idle.fall, draws}, {idle.fall, draws}};
    for (std::size_t t = 0; t < frames.size(); ++t) {
      const double time = static_cast<double>(t) / frame_rate;
      const Vector3d turn(idle.degrees[0] * waves[0](time), idle.degrees[1] * waves[1](time),
                          idle.degrees[2] * waves[2](time));
      Quaterniond& local = frames[t].local[idle.joint];
      local = local * TurnOf(turn);
    }
  }
}

void AddSecondaryMotion(const Eigen::Matrix3Xd& rest_joints, std::string_view action,
                        std::uint64_t seed, Clip& clip) {
  std::vector<BodyFrame> frames = BodyFrames(clip, rest_joints);
  const double rate = clip.frame_rate, end = static_cast<double>(frames.size()) / rate;
  RandomDraws draws(seed);
  const std::vector<BodyPlacement> placed = Place(rest_joints, frames);
  const double arrives = Arrives(placed, rate);
  const Part part = PartOf(action);
  Turns head(arrives, end, 1.1, part.head, draws);
  const Turns trunk(arrives, end, 1.4, part.trunk, draws);
  if (action == "call") {
    for (double at = arrives + draws.Uniform(0.5, 0.9); at + 0.7 < end;
         at += draws.Uniform(1.1, 1.8)) {  // nods twice
      const Vector3d up = head.Last(), down = up + Vector3d(draws.Uniform(4.0, 7.0), 0, 0);
      head.Add(at, 0.2, down);
      head.Add(at + 0.18, 0.2, up);
      head.Add(at + 0.36, 0.2, up + 0.5 * (down - up));
      head.Add(at + 0.54, 0.22, up);
    }
  }
  const std::vector<FeetTarget> feet = FeetOf(placed);
  const std::vector<Isometry3d> hands = HoldingHands(rest_joints, frames, clip);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const double time = static_cast<double>(t) / rate;
    BodyFrame& frame = frames[t];
    for (const int joint : {kSpine1, kSpine2, kSpine3}) {
      frame.local[joint] = TurnOf(trunk.At(time) / 3.0) * frame.local[joint];
    }
    for (const int joint : {kNeck, kHead}) {
      frame.local[joint] = TurnOf(0.5 * head.At(time)) * frame.local[joint];
    }
  }
  const std::vector<double> sink = PelvisSink(rest_joints, frames, feet);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    frames[t].pelvis.z() -= sink[t];
    PlaceLegs(rest_joints, feet[t], frames[t]);
  }
  TakeAlong(rest_joints, frames, hands, clip);
  SetBodyFrames(frames, rest_joints, clip);
}

namespace {

// As in captured people who stand and reach (docs/metrics.md, Standing).
constexpr double kSideways_m = 0.018, kForward_m = 0.008;  // of the pelvis, to either side
constexpr double kFadeIn_s = 0.8;                          // from where nothing may move
constexpr double kOffHip_degrees = 4.0;                    // for a shift of kSideways_m
constexpr double kStill_s = 1.7;                      // before the end, in which no movement begins
constexpr double kAtFace_m = 0.3, kOffFace_m = 0.45;  // of the object from the head

// Weight on one leg, then on the other: meters to the left and forward.
Turns DrawWeight(double begin_s, double end_s, RandomDraws& draws) {
  Turns weight;
  double side = draws.Uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0;
  for (double at = begin_s + draws.Uniform(0.0, 0.5); at < end_s - kStill_s; side = -side) {
    const double takes = draws.Uniform(0.9, 1.5);
    weight.Add(
        at, takes,
        {side * kSideways_m * draws.Uniform(0.6, 1.2), kForward_m * draws.Uniform(-1.0, 1.0), 0.0});
    at += takes + draws.Uniform(0.3, 1.2);
  }
  return weight;
}

// Free arm: raised forward and outward at the shoulder, flexed at the elbow; degrees. Beside a
// table it hangs.
Turns DrawArm(double begin_s, double end_s, bool table, RandomDraws& draws) {
  Turns arm;
  for (double at = begin_s + draws.Uniform(0.0, 0.4); at < end_s - kStill_s;) {
    const double takes = draws.Uniform(0.8, 1.3);
    arm.Add(at, takes,
            {draws.Uniform(-4.0, table ? 2.0 : 12.0), draws.Uniform(1.0, 9.0),
             draws.Uniform(0.0, table ? 10.0 : 35.0)});
    at += takes + draws.Uniform(0.2, 1.2);
  }
  return arm;
}

// Looks up and aside from the object, and back: nod, turn and tilt of the head, degrees.
Turns DrawLooks(std::string_view action, double end_s, RandomDraws& draws) {
  // What the hands do at the object is watched.
  constexpr std::string_view kWatched[] = {"inspect", "use", "chop", "pour", "cook"};
  const double share = std::ranges::find(kWatched, action) != std::end(kWatched) ? 0.4 : 1.0;
  Turns looks;
  for (double at = draws.Uniform(0.3, 1.0); at < end_s - kStill_s;) {
    const double turn = std::copysign(draws.Uniform(8.0, 25.0), draws.Uniform(-1.0, 1.0));
    looks.Add(at, 0.5, share * Vector3d(draws.Uniform(-26.0, -8.0), turn, 0.15 * turn));
    at += draws.Uniform(0.9, 1.5);
    looks.Add(at, 0.5, share * Vector3d(draws.Uniform(-4.0, 4.0), draws.Uniform(-4.0, 4.0), 0.0));
    at += draws.Uniform(0.9, 2.0);
  }
  return looks;
}

// Frames in which the object is put down or taken.
std::vector<int> Changes(const Clip& clip) {
  std::vector<int> changes;
  for (int t = 1; t < static_cast<int>(clip.holding_hand.size()); ++t) {
    if ((clip.holding_hand[t] == 0) != (clip.holding_hand[t - 1] == 0)) changes.push_back(t);
  }
  return changes;
}

// First frame in which the object is 2 cm from its first place.
int Leaves(const Clip& clip) {
  constexpr double kLeaves_m = 0.02;
  if (!clip.object) return 0;
  int t = 0;
  while (t + 1 < clip.NumFrames() &&
         (clip.object->trans.col(t) - clip.object->trans.col(0)).norm() < kLeaves_m) {
    ++t;
  }
  return t;
}

}  // namespace

void AddStandingMotion(const Eigen::Matrix3Xd& rest_joints, std::string_view action, bool free_arm,
                       bool table, std::uint64_t seed, Clip& clip) {
  std::vector<BodyFrame> frames = BodyFrames(clip, rest_joints);
  const double rate = clip.frame_rate, end = static_cast<double>(frames.size()) / rate;
  RandomDraws draws(seed);
  const Turns weight = DrawWeight(Leaves(clip) / rate, end, draws);
  const Turns arm = DrawArm(0.0, end, table, draws);
  const Turns looks = DrawLooks(action, end, draws);
  const std::vector<int> changes = Changes(clip);
  const std::vector<FeetTarget> feet = FeetOf(Place(rest_joints, frames));
  const std::vector<Isometry3d> hands = HoldingHands(rest_joints, frames, clip);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const double time = static_cast<double>(t) / rate;
    double share = 1.0;
    for (const int change : changes) {
      share *= MinimumJerk(std::min(1.0, std::abs(time - change / rate) / kFadeIn_s));
    }
    const Eigen::Vector2d shift = share * weight.At(time).head<2>();
    ShiftWeight(shift, 1.0, frames[t]);
    const Isometry3d head = Place(rest_joints, frames[t]).WorldFromJoint(kHead);
    double away = 1.0;
    if (clip.object) {
      const Vector3d object = clip.object->trans.col(static_cast<Eigen::Index>(t));
      away = ((object - head.translation()).norm() - kAtFace_m) / (kOffFace_m - kAtFace_m);
    }
    Vector3d look = MinimumJerk(std::clamp(away, 0.0, 1.0)) * looks.At(time);
    const double down = -std::asin(std::clamp(head.linear()(2, 2), -1.0, 1.0)) / kDegree;
    look.x() = std::max(look.x(), -std::max(0.0, down));  // up to the horizontal
    for (const int joint : {kNeck, kHead}) {
      frames[t].local[joint] = TurnOf(0.5 * look) * frames[t].local[joint];
    }
    // A hanging hand stays off the hip that comes out to it.
    const double out = kOffHip_degrees * std::abs(shift.x()) / kSideways_m;
    const bool hangs = clip.holding_hand.size() == frames.size() && clip.holding_hand[t] == 0;
    if (hangs && shift.x() < 0.0) {
      frames[t].local[kRightShoulder] = TurnOf({0.0, 0.0, -out}) * frames[t].local[kRightShoulder];
    }
    if (!free_arm) continue;
    const Vector3d raised = arm.At(time) + Vector3d(0.0, shift.x() > 0.0 ? out : 0.0, 0.0);
    Quaterniond &shoulder = frames[t].local[kLeftShoulder], &elbow = frames[t].local[kLeftElbow];
    shoulder = TurnOf({-raised.x(), 0.0, raised.y()}) * shoulder;
    elbow = elbow * Quaterniond(Eigen::AngleAxisd(raised.z() * kDegree, Arm(Side::kLeft).hinge));
  }
  const std::vector<double> sink = PelvisSink(rest_joints, frames, feet);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    frames[t].pelvis.z() -= sink[t];
    PlaceLegs(rest_joints, feet[t], frames[t]);
  }
  if (clip.object) {
    const ObjectTrack before = *clip.object;
    TakeAlong(rest_joints, frames, hands, clip);
    for (int t = 0; t < clip.NumFrames(); ++t) {
      if (clip.holding_hand[t] == 0) clip.object->SetPose(t, before.Pose(t));
    }
  }
  SetBodyFrames(frames, rest_joints, clip);
}

}  // namespace holdfast
