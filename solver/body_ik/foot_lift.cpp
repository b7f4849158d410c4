// SPDX-License-Identifier: MIT
#include "solver/body_ik/foot_lift.h"

#include <algorithm>

#include "generator/body/limb_ik.h"
#include "generator/scripted/minimum_jerk.h"

namespace holdfast {
namespace {

// A foot in the air between two stances: frames begin and end are planted.
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
      const SoleBits bits = contacts[static_cast<std::size_t>(t)];
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
      const double height = Height(points_[static_cast<std::size_t>(t - step.begin)]);
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
      frames_[static_cast<std::size_t>(t)] = Bent(t, bend * Share(t));
    }
  }

 private:
  double Share(int t) const {
    return t <= peak_ ? MinimumJerk(static_cast<double>(t - step_.begin) / (peak_ - step_.begin))
                      : MinimumJerk(static_cast<double>(step_.end - t) / (step_.end - peak_));
  }
  BodyFrame Bent(int t, double bend) const {
    BodyFrame frame = frames_[static_cast<std::size_t>(t)];
    const Limb leg = Leg(step_.foot == 0 ? Side::kLeft : Side::kRight);
    Eigen::Quaterniond& knee = frame.local[static_cast<std::size_t>(leg.middle)];
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

}  // namespace holdfast
