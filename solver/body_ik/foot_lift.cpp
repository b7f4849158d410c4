// SPDX-License-Identifier: MIT
#include "solver/body_ik/foot_lift.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "generator/body/limb_ik.h"
#include "generator/scripted/minimum_jerk.h"

namespace holdfast {
namespace {

// A foot in the air between two stances; it is planted in frames begin and end.
struct AirborneStep {
  int foot, begin, end;
};

std::vector<AirborneStep> StepsOf(const std::vector<SoleBits>& contacts) {
  std::vector<AirborneStep> steps;
  for (const int foot : {0, 1}) {
    const SoleBits own = foot == 0 ? kLeftSole : kRightSole;
    const SoleBits other = foot == 0 ? kRightSole : kLeftSole;
    int planted = -1;
    bool carried = true;
    for (int t = 0; t < static_cast<int>(contacts.size()); ++t) {
      const SoleBits bits = contacts[t];
      if ((bits & own) == 0) {
        carried = carried && (bits & other) != 0;
        continue;
      }
      if (planted >= 0 && t > planted + 3 && carried) steps.push_back({foot, planted, t});
      planted = t;
      carried = true;
    }
  }
  return steps;
}

class StepLift {
 public:
  StepLift(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles, const AirborneStep& step,
           std::vector<BodyFrame>& frames)
      : rest_joints_(rest_joints), soles_(soles), step_(step), frames_(frames) {
    for (int t = step.begin; t <= step.end; ++t) points_.push_back(At(t, 0.0));
    double highest = 0.0;
    for (int t = step.begin; t <= step.end; ++t) {
      const double height = Height(points_[t - step.begin]);
      if (height <= highest) continue;
      highest = height;
      peak_ = t;
    }
    const int length = step.end - step.begin;
    peak_ = std::clamp(peak_, step.begin + length / 4, step.begin + (3 * length) / 5);
  }

  double Length() const {
    return (points_.back().col(2 * step_.foot) - points_.front().col(2 * step_.foot))
        .head<2>()
        .norm();
  }

  double HighestWith(double bend) const {
    double highest = 0.0;
    for (int t = step_.begin; t <= step_.end; ++t) {
      highest = std::max(highest, Height(At(t, bend * Share(t))));
    }
    return highest;
  }

  void Bend(double bend) {
    for (int t = step_.begin + 1; t < step_.end; ++t) {
      frames_[t] = Bent(t, bend * Share(t));
    }
  }

 private:
  double Share(int t) const {
    return t <= peak_ ? MinimumJerk(static_cast<double>(t - step_.begin) / (peak_ - step_.begin))
                      : MinimumJerk(static_cast<double>(step_.end - t) / (step_.end - peak_));
  }
  BodyFrame Bent(int t, double bend) const {
    BodyFrame frame = frames_[t];
    const Limb leg = Leg(step_.foot == 0 ? Side::kLeft : Side::kRight);
    Eigen::Quaterniond& knee = frame.local[leg.middle];
    knee = (knee * Eigen::Quaterniond(Eigen::AngleAxisd(bend, leg.hinge))).normalized();
    return frame;
  }
  Soles At(int t, double bend) const { return soles_.At(Place(rest_joints_, Bent(t, bend))); }
  double Height(const Soles& soles) const {
    return std::max(soles(2, 2 * step_.foot), soles(2, 2 * step_.foot + 1));
  }

  const Eigen::Matrix3Xd& rest_joints_;
  const SolePoints& soles_;
  AirborneStep step_;
  std::vector<BodyFrame>& frames_;
  std::vector<Soles> points_;
  int peak_ = 0;
};

}  // namespace

void LiftFeet(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles,
              const std::vector<SoleBits>& contacts, std::vector<BodyFrame>& frames,
              const FootLiftOptions& options) {
  for (const AirborneStep& step : StepsOf(contacts)) {
    StepLift lift(rest_joints, soles, step, frames);
    const double length = lift.Length();
    if (length < options.least_stride_m) continue;
    const double wanted = options.lift_m * std::min(1.0, length / options.long_stride_m);
    if (lift.HighestWith(0.0) >= wanted) continue;
    double low = 0.0, high = options.most_bend_rad;
    if (lift.HighestWith(high) > wanted) {
      for (int halving = 0; halving < 8; ++halving) {
        const double middle = 0.5 * (low + high);
        (lift.HighestWith(middle) > wanted ? high : low) = middle;
      }
    }
    lift.Bend(high);
  }
}

FootPinner::FootPinner(Eigen::Matrix3Xd rest_joints, double sole_y)
    : rest_joints_(std::move(rest_joints)), soles_(rest_joints_, sole_y) {
  drift_.fill(Eigen::Vector2d::Zero());
}

bool FootPinner::CanStand(int foot) const {
  const Foot& it = feet_[foot];
  if (it.steps > 0) return false;
  const bool free_to_go = it.stands && it.frames >= kMinStance;
  return lowest_[foot] < (it.stands ? kHigh : kLow) && speed_[foot] < (free_to_go  ? kFast
                                                                       : it.stands ? 2.0 * kFast
                                                                                   : kSlow);
}

void FootPinner::Choose() {
  std::array<bool, 2> stands = {CanStand(0), CanStand(1)};
  if (!stands[0] && !stands[1]) {
    const auto cost = [&](int foot) {
      return lowest_[foot] / kLow + speed_[foot] / kSlow + (feet_[foot].stands ? -0.5 : 0.0) +
             (feet_[foot].steps > 0 ? 4.0 : 0.0);
    };
    const int better = cost(0) <= cost(1) ? 0 : 1;
    stands[better] = lowest_[better] < kAirborne;
  }
  for (const int foot : {0, 1}) {
    Foot& it = feet_[foot];
    it.frames = it.stands == stands[foot] ? it.frames + 1 : 0;
    it.stands = stands[foot];
    if (it.stands) it.steps = 0;
  }
  for (const int foot : {0, 1}) {
    Foot& it = feet_[foot];
    const Foot& other = feet_[1 - foot];
    if (!it.stands || !other.stands || other.frames < kMinStance) continue;
    if (it.correction.head<2>().norm() < kFarthest && std::abs(it.yaw) < kMaxYaw) continue;
    it.stands = false;
    it.frames = 0;
    it.steps = kStep;
    return;
  }
}

void FootPinner::Correct(int foot) {
  Foot& it = feet_[foot];
  double height = -lowest_[foot];
  if (it.stands) {
    it.correction.head<2>() -= drift_[foot];
    it.yaw = std::clamp(it.yaw - turn_[foot], -kMaxYaw, kMaxYaw);
  } else if (it.steps > 0) {
    // The remaining distance over the remaining frames, with eased ends.
    const double before = MinimumJerk(1.0 - static_cast<double>(it.steps) / kStep);
    const double after = MinimumJerk(1.0 - static_cast<double>(it.steps - 1) / kStep);
    it.correction.head<2>() *= (1.0 - after) / (1.0 - before);
    it.yaw *= (1.0 - after) / (1.0 - before);
    const double phase = 1.0 - static_cast<double>(it.steps - 1) / kStep;
    height = std::max(0.0, height) + kLift * 4.0 * phase * (1.0 - phase);
    --it.steps;
  } else {
    it.correction.head<2>() *= kBack;
    it.yaw *= kBack;
    const double clearance =
        kClearance * std::clamp((speed_[foot] - kSlow) / (2.0 * kSlow), 0.0, 1.0);
    height = std::max(0.0, clearance - lowest_[foot]);
  }
  it.correction.z() = std::max(
      std::clamp(height, it.correction.z() - kRise, it.correction.z() + kRise), -lowest_[foot]);
}

void FootPinner::Pin(BodyFrame& frame) {
  LevelToes(rest_joints_, soles_, 1.0, frame);
  const BodyPlacement placed = Place(rest_joints_, frame);
  now_ = soles_.At(placed);
  if (frame_ == 0) last_ = now_;
  for (const int foot : {0, 1}) {
    const int heel = 2 * foot, ball = heel + 1;
    const int point = now_(2, ball) < kLow ? ball : heel;
    drift_[foot] = (now_.col(point) - last_.col(point)).head<2>();
    speed_[foot] = kFrameRate * drift_[foot].norm();
    lowest_[foot] = std::min(now_(2, heel), now_(2, ball));
    const Eigen::Vector2d points = (now_.col(ball) - now_.col(heel)).head<2>();
    const double heading = std::atan2(points.y(), points.x());
    turn_[foot] =
        frame_ == 0 ? 0.0 : std::remainder(heading - heading_[foot], 2.0 * std::numbers::pi);
    heading_[foot] = heading;
  }
  Choose();
  FeetTarget feet = FeetOf(placed);
  for (const int foot : {0, 1}) {
    if (frame_ > 0) Correct(foot);
    // The foot rotates about its pinned point.
    const int point = 2 * foot + (now_(2, 2 * foot + 1) < kLow ? 1 : 0);
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(feet_[foot].yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Vector3d pivot = now_.col(point);
    feet.rotation[foot] = turn * feet.rotation[foot];
    feet.ankle[foot] = pivot + turn * (feet.ankle[foot] - pivot) + feet_[foot].correction;
  }
  const double needed = std::min(PelvisSink(rest_joints_, {frame}, {feet})[0], kMaxSink);
  sink_ = std::clamp(needed, sink_ - kSinkOut, sink_ + kSinkIn);
  frame.pelvis.z() -= sink_;
  const BodyFrame before = frame;
  PlaceLegs(rest_joints_, feet, frame);
  // Fade in: legs placed at their own position may still bend differently than the input.
  const double share = MinimumJerk(static_cast<double>(frame_) / kFadeIn);
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const Limb leg = Leg(side);
    for (const int joint : {leg.root, leg.middle, leg.end}) {
      frame.local[joint] = before.local[joint].slerp(share, frame.local[joint]);
    }
  }
  last_ = now_;
  ++frame_;
}

Eigen::Vector2d FootPinner::Drag() const {
  Eigen::Vector2d drag = Eigen::Vector2d::Zero();
  for (const Foot& foot : feet_) {
    const Eigen::Vector2d correction = foot.correction.head<2>();
    const double length = correction.norm();
    if (!foot.stands || length <= kGivesWay) continue;
    const Eigen::Vector2d excess = correction * (1.0 - kGivesWay / length);
    if (excess.squaredNorm() > drag.squaredNorm()) drag = excess;
  }
  return drag;
}

void FootPinner::Follow(const Eigen::Vector2d& moved) {
  last_.topRows<2>().colwise() += moved;
  for (Foot& foot : feet_) {
    if (foot.stands) foot.correction.head<2>() -= moved;
  }
}

void LevelToes(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles, double share,
               BodyFrame& frame, double most_rad) {
  constexpr double kAll = 0.03, kNothing = 0.10;  // meters of the ball above the ground
  const BodyPlacement placed = Place(rest_joints, frame);
  const Soles points = soles.At(placed);
  for (const int foot : {0, 1}) {
    const int joint = foot == 0 ? kLeftFoot : kRightFoot;
    const Eigen::Matrix3d& toes = placed.rotation[joint];
    const double down = -std::asin(std::clamp(toes(2, 2), -1.0, 1.0));  // of the rest frame's z
    const double near =
        share * MinimumJerk((kNothing - points(2, 2 * foot + 1)) / (kNothing - kAll));
    if (down <= 0.0 || near <= 0.0) continue;
    const Eigen::Quaterniond before = frame.local[joint];
    const auto bent = [&](double by) {
      const Eigen::Quaterniond up(Eigen::AngleAxisd(-by * near * down, Eigen::Vector3d::UnitX()));
      return (before * up).normalized();
    };
    const Eigen::Quaterniond rest = Eigen::Quaterniond::Identity();
    const double most = std::max(most_rad, before.angularDistance(rest));
    double by = 1.0;
    while (by > 0.01 && bent(by).angularDistance(rest) > most) by *= 0.95;
    frame.local[joint] = bent(by);
  }
}

}  // namespace holdfast
