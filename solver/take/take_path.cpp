// SPDX-License-Identifier: MIT
#include "solver/take/take_path.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "generator/scripted/minimum_jerk.h"
#include "geometry/body/skeleton.h"
#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kClosing_s = 0.3, kLine_s = 0.35, kBefore_s = 0.55;
constexpr double kLift_m = 0.06, kLift_s = 0.5;
constexpr double kOver_m = 0.12, kOff_m = 0.50;  // horizontal: above the table, clear of it
constexpr double kStay_s = 0.4, kStayWithBody_s = 0.6;
constexpr double kEase = 0.35;  // fraction of the way back to carrying, at the last place
constexpr double kSlowest = 0.25, kSlow_s = 0.5;  // of GiveTime
constexpr double kStays_m = 0.05, kStays_s = 0.6;

int Frames(double seconds, double frame_rate) {
  return static_cast<int>(std::lround(seconds * frame_rate));
}

// Gaussian means, with constant extrapolation.
std::vector<Eigen::Vector4d> Steadied(const std::vector<Eigen::Vector4d>& values, double sigma) {
  const int count = static_cast<int>(values.size());
  const int radius = static_cast<int>(std::ceil(3.0 * sigma));
  std::vector<Eigen::Vector4d> steady(values.size());
  for (int t = 0; t < count; ++t) {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    double total = 0.0;
    for (int d = -radius; d <= radius; ++d) {
      const double weight = std::exp(-0.5 * (d / sigma) * (d / sigma));
      sum += weight * values[std::clamp(t + d, 0, count - 1)];
      total += weight;
    }
    steady[t] = sum / total;
  }
  return steady;
}

double YawOf(const Isometry3d& frame) {
  return std::atan2(frame.linear()(1, 0), frame.linear()(0, 0));
}

double Nearest(double angle, double to) {
  return to + std::remainder(angle - to, 2.0 * std::numbers::pi);
}

UprightPose Between(const UprightPose& a, const UprightPose& b, double share) {
  return {a.position + share * (b.position - a.position),
          a.yaw_rad + share * (b.yaw_rad - a.yaw_rad)};
}

// Bodies that wait or turn before walking away would move a low carried object into the table.
void StayAbove(const UprightPose& lifted, UprightPose& pose) {
  const double away = (pose.position - lifted.position).head<2>().norm();
  const double over = 1.0 - MinimumJerk((away - kOver_m) / (kOff_m - kOver_m));
  pose.position.z() += over * std::max(0.0, lifted.position.z() - pose.position.z());
}

}  // namespace

Isometry3d UprightPose::Transform() const {
  return RigidTransform(Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()).matrix(), position);
}

TakeTimes TimesOfTake(std::span<const BodyPlacement> body, std::span<const int> reached,
                      const Vector3d& pregrasp, const Vector3d& wrist, const ArmIk& arm,
                      double frame_rate) {
  const int count = static_cast<int>(body.size());
  const int closing = Frames(kClosing_s, frame_rate);
  const int least = Frames(0.8, frame_rate);
  if (reached.empty() || reached.front() < least || reached.back() >= count ||
      !std::ranges::is_sorted(reached, std::less_equal<>())) {
    throw Error("take",
                fmt::format("the motion ({} frames) does not reach the object and the positions "
                            "after it in this order",
                            count),
                "Generate another motion");
  }
  // Excess over the arm's length, from arrival until the object is off the table.
  const auto over = [&](int t, const Vector3d& place) {
    const Vector3d shoulder = body[std::min(t, count - 1)].joints.col(arm.Bones().root);
    return std::max(0.0, (place - shoulder).norm() - 0.95 * arm.Length());
  };
  const int line = Frames(kLine_s, frame_rate);
  const int until = closing + Frames(kLift_s, frame_rate);
  const int slack = Frames(0.4, frame_rate);
  const int latest = reached.size() > 1 ? reached[1] - until - least : count - 1 - closing;
  TakeTimes times;
  double best = std::numeric_limits<double>::infinity();
  times.arrive = reached.front();
  for (int a = std::max(least, reached.front() - slack);
       a <= std::min(reached.front() + slack, latest); ++a) {
    double cost = 1e-4 * std::abs(a - reached.front() + Frames(0.1, frame_rate));
    for (int t = a - line; t < a; ++t) cost += over(t, pregrasp);
    for (int t = a; t < std::min(count, a + until); ++t) cost += over(t, wrist);
    if (cost < best) {
      best = cost;
      times.arrive = a;
    }
  }
  times.take = std::min(count - 1, times.arrive + closing);
  times.pregrasp = times.arrive - line;
  times.begin = std::max(0, times.pregrasp - Frames(kBefore_s, frame_rate));
  times.goals.assign(reached.begin() + 1, reached.end());
  return times;
}

void GiveTime(const Eigen::Matrix3Xd& rest_joints, int shoulder, int at, double frame_rate,
              std::vector<BodyFrame>& frames, std::vector<int>& reached) {
  const int count = static_cast<int>(frames.size());
  const Vector3d here = Place(rest_joints, frames[at]).joints.col(shoulder);
  bool stays = true;
  for (int t = at; t < std::min(count, at + Frames(kStays_s, frame_rate)); ++t) {
    stays &= (Place(rest_joints, frames[t]).joints.col(shoulder) - here).norm() < kStays_m;
  }
  if (stays) return;
  const auto speed = [&](double place) {
    const double from = (place - at) / (0.5 * kSlow_s * frame_rate);
    return std::abs(from) >= 1.0
               ? 1.0
               : 1.0 - (1.0 - kSlowest) * 0.5 * (1.0 + std::cos(std::numbers::pi * from));
  };
  std::vector<BodyFrame> slowed;
  std::vector<int> moved = reached;
  double place = 0.0;
  std::size_t next = 0;
  while (place < count - 1 + 1e-9) {
    const int before = std::min(static_cast<int>(place), count - 1);
    const int after = std::min(before + 1, count - 1);
    while (next < reached.size() && place >= reached[next] - 0.5) {
      moved[next++] = static_cast<int>(slowed.size());
    }
    slowed.push_back(Interpolate(frames[before], frames[after], place - before));
    // The speed is taken at the middle of the step.
    place += speed(place + 0.5 * speed(place));
  }
  while (next < reached.size()) moved[next++] = static_cast<int>(slowed.size()) - 1;
  frames = std::move(slowed);
  reached = std::move(moved);
}

std::vector<Isometry3d> CarryFrames(std::span<const BodyPlacement> body, double frame_rate) {
  std::vector<Eigen::Vector4d> values;
  for (const BodyPlacement& placed : body) {
    const Vector3d left = placed.rotation[kSpine3].col(0);
    double yaw = std::atan2(left.y(), left.x()) - 0.5 * std::numbers::pi;
    if (!values.empty()) yaw = Nearest(yaw, values.back()(3));
    Eigen::Vector4d value;
    value << placed.joints.col(kSpine3), yaw;
    values.push_back(value);
  }
  std::vector<Isometry3d> frames;
  for (const Eigen::Vector4d& value : Steadied(values, 0.15 * frame_rate)) {
    frames.push_back(UprightPose{value.head<3>(), value(3)}.Transform());
  }
  return frames;
}

UprightPose ComfortableCarry(const ArmIk& arm, const TakeCandidate& take, const TakeObject& object,
                             std::span<const BodyPlacement> body,
                             std::span<const Isometry3d> carry_frames, int take_frame,
                             std::span<const int> frames) {
  const double taken = take.yaw_rad - YawOf(carry_frames[take_frame]);
  const double side = arm.ArmSide() == Side::kRight ? -1.0 : 1.0;
  const Vector3d bottom = object.BottomMiddle();
  UprightPose best;
  double least = std::numeric_limits<double>::infinity();
  // Search the wrist's position in the carry frame, then the object's yaw.
  for (const double ahead : {0.22, 0.28, 0.34}) {
    for (const double aside : {0.08, 0.15, 0.22}) {
      for (const double above : {-0.18, -0.10, -0.02}) {
        for (int k = 0; k < 36; ++k) {
          const double yaw = 2.0 * std::numbers::pi * k / 36;
          UprightPose pose{Vector3d::Zero(), yaw};
          const Isometry3d wrist_at_origin = take.WristFor(pose.Transform());
          pose.position = Vector3d(ahead, side * aside, above) - wrist_at_origin.translation();
          // The object itself stays in front of the body.
          const Vector3d middle = pose.Transform() * bottom;
          double cost =
              400.0 * std::pow(std::max(0.0, 0.2 - middle.x()), 2) +
              4.0 * std::pow(ahead - 0.3, 2) +
              std::pow(std::remainder(yaw - taken, 2.0 * std::numbers::pi) / (75.0 * kDegree), 2);
          for (const int t : frames) {
            const ArmTarget target =
                arm.TargetFor(body[t], take.WristFor(carry_frames[t] * pose.Transform()));
            // A few typical swivels suffice for comparison.
            double comfort = std::numeric_limits<double>::infinity();
            for (const double swivel : {-10.0, 10.0, 30.0}) {
              const ArmChoice choice = arm.At(target, swivel * kDegree);
              const double bend = (choice.limb.flexion_rad - 85.0 * kDegree) / (35.0 * kDegree);
              comfort =
                  std::min(comfort, choice.discomfort + bend * bend + 50.0 * choice.shortfall_m);
            }
            cost += comfort / static_cast<double>(frames.size());
          }
          if (cost < least) {
            least = cost;
            best = pose;
          }
        }
      }
    }
  }
  return best;
}

std::vector<Isometry3d> ObjectWay(const TakeTimes& times, const UprightPose& standing,
                                  const UprightPose& carry, std::span<const UprightPose> at_goals,
                                  std::span<const Isometry3d> carry_frames, double frame_rate,
                                  double leave_s, double follow_s, double bring_s) {
  const int count = static_cast<int>(carry_frames.size());
  const auto share = [&](int t, int from, double seconds) {
    return MinimumJerk((t - from) / (seconds * frame_rate));
  };
  // Continuous yaws of the carry frames, starting near the standing object's.
  std::vector<double> turn(carry_frames.size());
  const int take = times.take;
  turn[take] = Nearest(YawOf(carry_frames[take]) + carry.yaw_rad, standing.yaw_rad);
  for (int t = take + 1; t < count; ++t) {
    turn[t] = Nearest(YawOf(carry_frames[t]) + carry.yaw_rad, turn[t - 1]);
  }
  std::vector<Isometry3d> way(carry_frames.size(), standing.Transform());
  for (int t = take; t < count; ++t) {
    UprightPose lifted = standing;
    lifted.position.z() += kLift_m * share(t, take, kLift_s);
    const UprightPose carried{carry_frames[t] * carry.position, turn[t]};
    const int leave = take + Frames(leave_s, frame_rate);
    UprightPose pose = Between(lifted, carried, share(t, leave, follow_s));
    StayAbove(lifted, pose);
    for (std::size_t g = 0; g < at_goals.size(); ++g) {
      const int at = times.goals[g], stayed = std::min(count - 1, at + Frames(kStay_s, frame_rate));
      const int from = std::max(leave, at - Frames(bring_s, frame_rate));
      double there = share(t, from, (at - from) / frame_rate);
      UprightPose goal = at_goals[g];
      goal.yaw_rad = Nearest(goal.yaw_rad, turn[std::min(at, count - 1)]);
      if (g + 1 < at_goals.size()) {
        there *= 1.0 - share(t, stayed, follow_s);
      } else if (t > stayed) {
        const UprightPose with_body{
            carry_frames[t] * (carry_frames[stayed].inverse() * goal.position),
            goal.yaw_rad + turn[t] - turn[stayed]};
        goal = Between(goal, Between(with_body, carried, kEase), share(t, stayed, kStayWithBody_s));
      }
      pose = Between(pose, goal, there);
    }
    way[t] = pose.Transform();
  }
  return way;
}

}  // namespace holdfast
