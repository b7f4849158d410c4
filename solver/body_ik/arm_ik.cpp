// SPDX-License-Identifier: MIT
#include "solver/body_ik/arm_ik.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "generator/body/limb_ik.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kMinSwivel = -40.0 * kDegree, kGreatestSwivel = 100.0 * kDegree;
constexpr double kGrid = 4.0 * kDegree;
constexpr double kSwivelSpeed = 120.0 * kDegree;  // per second: costs as much as a discomfort of 1
constexpr double kBell_s = 0.1;

double Square(double x) { return x * x; }

}  // namespace

ArmIk::ArmIk(Eigen::Matrix3Xd rest_joints, Side side)
    : rest_joints_(std::move(rest_joints)),
      side_(side),
      limb_(Arm(side)),
      longest_(MaxReach(rest_joints_, limb_)) {}

ArmChoice ArmIk::At(const ArmTarget& target, double swivel_rad) const {
  const double sign = side_ == Side::kRight ? 1.0 : -1.0;
  const Eigen::Vector3d position = target.wrist.translation();
  const Eigen::Vector3d to_wrist = position - target.shoulder;
  const Eigen::Vector3d axis = to_wrist.norm() > 1e-9 ? to_wrist.normalized().eval()
                                                      : Eigen::Vector3d(-Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d hanging = target.chest * Eigen::Vector3d(-0.45 * sign, -1.0, -0.30);
  const Eigen::Vector3d pole = ExpSO3(-sign * swivel_rad * axis) * hanging;
  ArmChoice arm;
  arm.swivel_rad = swivel_rad;
  arm.limb = SolveLimb(rest_joints_, limb_, target.shoulder, position, pole);
  arm.shortfall_m = arm.limb.reached ? 0.0 : (arm.limb.end - position).norm();
  arm.wrist = SolveWrist(rest_joints_, side_, arm.limb.lower, target.wrist.linear());
  arm.hand_error_rad = AngleBetween(arm.wrist.lower * arm.wrist.wrist, target.wrist.linear());
  arm.discomfort =
      Square(swivel_rad / (24.0 * kDegree)) + Square(arm.wrist.flexion_rad / (40.0 * kDegree)) +
      Square((arm.wrist.ulnar_rad - 8.0 * kDegree) / (22.0 * kDegree)) +
      Square(arm.wrist.twist_rad / (55.0 * kDegree)) + Square(arm.hand_error_rad / (1.0 * kDegree));
  return arm;
}

ArmChoice ArmIk::Best(const ArmTarget& target) const {
  double best = 0.0, least = std::numeric_limits<double>::infinity();
  for (double swivel = kMinSwivel; swivel <= kGreatestSwivel; swivel += 10.0 * kDegree) {
    const double discomfort = At(target, swivel).discomfort;
    if (discomfort < least) {
      least = discomfort;
      best = swivel;
    }
  }
  // Golden-section search within one step on either side.
  double low = best - 10.0 * kDegree, high = best + 10.0 * kDegree;
  while (high - low > 1.0 * kDegree) {
    const double step = (2.0 - std::numbers::phi) * (high - low);
    if (At(target, low + step).discomfort < At(target, high - step).discomfort) {
      high -= step;
    } else {
      low += step;
    }
  }
  return At(target, 0.5 * (low + high));
}

std::vector<double> ArmIk::Track(std::span<const ArmTarget> targets, double frame_rate) const {
  const int count = static_cast<int>(targets.size());
  if (count == 0) return {};
  const int states = static_cast<int>(std::lround((kGreatestSwivel - kMinSwivel) / kGrid)) + 1;
  const auto swivel = [](int s) { return kMinSwivel + kGrid * s; };
  // Costs are per frame; kSwivelSpeed for a second costs as much as a discomfort of 1.
  const double change = Square(kGrid * frame_rate / kSwivelSpeed);
  const std::vector<int> path = CheapestPath(
      count, states, change, [&](int t, int s) { return At(targets[t], swivel(s)).discomfort; });
  std::vector<double> coarse;
  for (const int s : path) coarse.push_back(swivel(s));
  const int radius = static_cast<int>(std::lround(3.0 * kBell_s * frame_rate));
  std::vector<double> smooth(targets.size());
  for (int t = 0; t < count; ++t) {
    double sum = 0.0, total = 0.0;
    for (int d = -radius; d <= radius; ++d) {
      const double weight = std::exp(-0.5 * Square(d / (kBell_s * frame_rate)));
      sum += weight * coarse[std::clamp(t + d, 0, count - 1)];
      total += weight;
    }
    smooth[t] = sum / total;
  }
  return smooth;
}

std::vector<int> CheapestPath(int steps, int states, double change,
                              const std::function<double(int, int)>& cost) {
  std::vector<double> before(static_cast<std::size_t>(states)), next(before.size());
  std::vector<std::vector<int>> from(static_cast<std::size_t>(steps),
                                     std::vector<int>(before.size(), 0));
  for (int t = 0; t < steps; ++t) {
    for (int s = 0; s < states; ++s) {
      const double here = cost(t, s);
      double least = t == 0 ? 0.0 : std::numeric_limits<double>::infinity();
      for (int p = 0; t > 0 && p < states; ++p) {
        const double total = before[p] + change * Square(s - p);
        if (total < least) {
          least = total;
          from[t][s] = p;
        }
      }
      next[s] = here + least;
    }
    before.swap(next);
  }
  std::vector<int> path(from.size());
  int at = static_cast<int>(std::ranges::min_element(before) - before.begin());
  for (int t = steps - 1; t >= 0; --t) {
    path[t] = at;
    at = from[t][at];
  }
  return path;
}

void SwingArms(const Eigen::Matrix3Xd& rest_joints, const std::array<double, 2>& idle, double walks,
               BodyFrame& frame) {
  using Eigen::Quaterniond;
  using Eigen::Vector3d;
  constexpr double kPerMeter = 1.35;  // radians of the upper arm per meter between the ankles
  constexpr double kMost = 0.8;       // radians
  constexpr double kBend = 0.6;       // of the elbow, per radian forward
  constexpr double kHangs = 0.6;      // fraction of the rotation to a hanging arm
  constexpr double kRestBend = 0.25;  // radians, elbow of a hanging arm
  const BodyPlacement placed = Place(rest_joints, frame);
  const double yaw = Yaw(frame);
  const Vector3d forward(std::sin(yaw), -std::cos(yaw), 0.0);
  const Vector3d to_left(std::cos(yaw), std::sin(yaw), 0.0);
  const double apart = forward.dot(placed.joints.col(kLeftAnkle) - placed.joints.col(kRightAnkle));
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const bool left = side == Side::kLeft;
    const double share = idle[left ? 0 : 1];
    if (share <= 0.0) continue;
    const double ahead = walks * kMost * std::tanh(kPerMeter * (left ? -apart : apart) / kMost);
    const Limb arm = Arm(side);
    const Vector3d upper =
        (placed.joints.col(arm.middle) - placed.joints.col(arm.root)).normalized();
    const Vector3d hanging = Vector3d(-Vector3d::UnitZ() + (left ? 0.2 : -0.2) * to_left);
    const Quaterniond hangs =
        Quaterniond::Identity().slerp(share * kHangs, Quaterniond::FromTwoVectors(upper, hanging));
    // A hanging arm swings forward about the axis to the right: forward x down.
    const Quaterniond swings(Eigen::AngleAxisd(share * ahead, Vector3d(-to_left)));
    const Quaterniond parent(placed.rotation[kJointParents[arm.root]]);
    frame.local[arm.root] =
        (parent.conjugate() * swings * hangs * parent * frame.local[arm.root]).normalized();
    const Quaterniond bent(Eigen::AngleAxisd(kRestBend + kBend * std::max(0.0, ahead), arm.hinge));
    frame.local[arm.middle] = frame.local[arm.middle].slerp(share * kHangs, bent);
  }
}

}  // namespace holdfast
