// SPDX-License-Identifier: MIT
#include "geometry/conventions/posture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "geometry/body/skeleton.h"
#include "geometry/conventions/hand_evidence.h"
#include "geometry/error.h"
#include "geometry/retarget/ground_contact.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr int kMaxSampled = 2000;  // frames in which posture is measured

// Rotates `axis` times `sign` to +z.
Eigen::Matrix3d ToZUp(int axis, int sign) {
  return RotationBetween(sign * Eigen::Vector3d::Unit(axis), Eigen::Vector3d::UnitZ())
      .toRotationMatrix();
}

struct Sampled {
  std::vector<int> frames;
  std::vector<BodyState> states;  // root at the origin, file's axes
  double rate = 0;                // samples per second
};

Sampled Sample(const LooseMotion& motion, const Eigen::Matrix3Xd& rest) {
  Sampled sampled;
  const int step = std::max(1, motion.frames / kMaxSampled);
  sampled.rate = (motion.frame_rate > 0 ? motion.frame_rate : 30.0) / step;
  for (int t = 0; t < motion.frames; t += step) {
    sampled.frames.push_back(t);
    sampled.states.emplace_back();
    ForwardJoints(rest, motion.pose[t], Eigen::Vector3d::Zero(), sampled.states.back());
  }
  return sampled;
}

void FindUp(const Sampled& sampled, Posture& posture) {
  std::vector<double> component[3];
  int nearest[3] = {0, 0, 0};
  for (const BodyState& state : sampled.states) {
    const Eigen::Vector3d up = state.joints.col(kHead) -
                               0.5 * (state.joints.col(kLeftFoot) + state.joints.col(kRightFoot));
    for (int k = 0; k < 3; ++k) component[k].push_back(up[k]);
    int axis = 0;
    up.cwiseAbs().maxCoeff(&axis);
    ++nearest[axis];
  }
  double along[3];
  for (int k = 0; k < 3; ++k) along[k] = Median(component[k]);
  const auto largest = std::max_element(
      along, along + 3, [](double a, double b) { return std::fabs(a) < std::fabs(b); });
  posture.axis = static_cast<int>(largest - along);
  posture.sign = *largest < 0 ? -1 : 1;
  posture.head_over_feet = std::fabs(*largest);
  posture.share =
      sampled.states.empty() ? 0.0 : double(nearest[posture.axis]) / double(sampled.states.size());
  // A person who lies or crawls throughout the clip gives no evidence. When sitting, the head is
  // 1.15 m above the feet; on all fours it is 1 m in front of them.
  posture.up_is_certain = posture.head_over_feet > 1.1 && posture.share > 0.6;
}

// Ground height under a motion whose trans is multiplied by `scale`.
double GroundHeight(const LooseMotion& motion, const Sampled& sampled, const GroundProbe& probe,
                    const Eigen::Matrix3d& turn, double scale, double* grounded_share) {
  std::vector<Eigen::Matrix3Xd> points;
  for (std::size_t i = 0; i < sampled.states.size(); ++i) {
    const BodyState& state = sampled.states[i];
    Eigen::Matrix<double, 3, kNumJoints> joints =
        turn * (state.joints.colwise() + scale * motion.trans.col(sampled.frames[i]));
    std::array<Eigen::Matrix3d, kNumJoints> rotations = state.world_rotation;
    for (Eigen::Matrix3d& R : rotations) R = turn * R;
    points.push_back(probe.LowestPoints(joints, rotations));
  }
  const double ground = FindGround(points, sampled.rate, false).height;
  if (grounded_share != nullptr) {
    int grounded = 0;
    for (const Eigen::Matrix3Xd& p : points) {
      grounded += p.leftCols(GroundProbe::kNumSoles).row(2).minCoeff() < ground + 0.03;
    }
    *grounded_share = points.empty() ? 0.0 : double(grounded) / double(points.size());
  }
  return ground;
}

Eigen::Vector3d HeadOverFeet(const Eigen::Matrix3Xd& positions, const SkeletonMap& map, int head) {
  return positions.col(head) - 0.5 * (positions.col(map.source[7]) + positions.col(map.source[8]));
}

// Height of the lowest joint along an axis, per frame: near zero along the up axis in most files.
std::vector<double> LowestAlong(const SourceMotion& motion, int axis, int sign) {
  std::vector<double> lowest;
  for (const Eigen::Matrix3Xd& positions : motion.positions) {
    lowest.push_back((sign * positions.row(axis)).minCoeff());
  }
  return lowest;
}

// Limits of the angle between a joint's rest and its pose, degrees; generous to allow for loose
// clothing, shape and marker noise.
double LimitDegrees(int joint) {
  if (joint == 0) return 1e9;                             // the root rotates freely
  if (joint >= kLeftHandBegin) return 140;                // finger joints, thumb saddle
  if (joint == 23 || joint == 24) return 90;              // eyes
  if (joint == 22) return 60;                             // jaw
  if (joint == 1 || joint == 2) return 150;               // hips
  if (joint == 4 || joint == 5) return 170;               // knees
  if (joint == 7 || joint == 8) return 100;               // ankles
  if (joint == 10 || joint == 11) return 90;              // balls of the feet
  if (joint == 3 || joint == 6 || joint == 9) return 80;  // spine, each
  if (joint == 12 || joint == 15) return 90;              // neck, head
  if (joint == 13 || joint == 14) return 80;              // collars
  if (joint == 16 || joint == 17) return 179;             // shoulders
  if (joint == 18 || joint == 19) return 175;             // elbows, with the forearm's roll
  return 130;                                             // wrists
}

double Angle(const Eigen::Vector3d& w) {
  const double turns = std::fmod(w.norm(), 2.0 * std::numbers::pi);
  return std::min(turns, 2.0 * std::numbers::pi - turns);
}

}  // namespace

std::string AxisName(const Posture& posture) {
  return fmt::format("{}{}", posture.sign < 0 ? "-" : "", "xyz"[posture.axis]);
}

Posture MeasurePosture(const LooseMotion& motion, const BodyModel& body) {
  Posture posture;
  if (motion.frames == 0 || !motion.has_root) return posture;
  const Eigen::Matrix3Xd rest = body.RestJoints(body.Template());
  const Sampled sampled = Sample(motion, rest);
  FindUp(sampled, posture);

  const GroundProbe probe(rest, body.Template().row(1).minCoeff());
  Eigen::Matrix3d turn = ToZUp(posture.axis, posture.sign);
  // Lying looks like standing along another axis, but without a floor there.
  if (posture.up_is_certain && posture.axis != 2 && motion.has_trans) {
    const auto floor = [&](const Eigen::Matrix3d& to_z) {
      return std::fabs(GroundHeight(motion, sampled, probe, to_z, 1.0, nullptr));
    };
    constexpr double kAtZero_m = 0.15;
    if (floor(turn) > kAtZero_m && floor(Eigen::Matrix3d::Identity()) < kAtZero_m) {
      posture.up_is_certain = false;
      posture.axis = 2;
      posture.sign = 1;
      turn.setIdentity();
    }
  }
  // The unit is determined by a body on the ground: only the correct one puts it there. Half a
  // meter is allowed for floors that are not at zero.
  constexpr double kUnits[] = {1.0, 0.01, 0.001};
  constexpr double kNear_m = 0.5;
  double best = 1e300;
  int matching = 0;
  for (const double unit : kUnits) {
    const double ground = GroundHeight(motion, sampled, probe, turn, unit, nullptr);
    if (std::fabs(ground) < kNear_m) ++matching;
    if (std::fabs(ground) < best) {
      best = std::fabs(ground);
      posture.meters_per_unit = unit;
    }
  }
  posture.unit_is_certain = posture.up_is_certain && motion.has_trans && matching == 1;
  // A floor far from zero is likelier than an unusual unit, unless the unit explains it.
  if (!posture.unit_is_certain) posture.meters_per_unit = 1.0;
  const double unit = posture.meters_per_unit;
  posture.ground_m = GroundHeight(motion, sampled, probe, turn, unit, &posture.grounded_share);
  std::vector<double> heights;
  for (std::size_t i = 0; i < sampled.states.size(); ++i) {
    const Eigen::Vector3d root =
        turn * (sampled.states[i].joints.col(0) + unit * motion.trans.col(sampled.frames[i]));
    heights.push_back(root.z() - posture.ground_m);
  }
  posture.root_height_m = Median(heights);
  for (int t = 1; t < motion.frames; ++t) {
    const double step = unit * (motion.trans.col(t) - motion.trans.col(t - 1)).norm();
    posture.fastest_root_m_per_s = std::max(
        posture.fastest_root_m_per_s, step * (motion.frame_rate > 0 ? motion.frame_rate : 30.0));
  }
  return posture;
}

void RequireMeters(const std::string& source, const Clip& clip, const BodyModel& body) {
  const Posture posture = MeasurePosture(LooseMotionOf(clip), body);
  if (!posture.unit_is_certain || posture.meters_per_unit == 1.0) return;
  throw Error(
      source,
      fmt::format(
          "its positions are in {}, not in meters: in meters, the feet would not be on the ground",
          posture.meters_per_unit == 0.01 ? "centimeters" : "millimeters"),
      fmt::format("Convert it to meters: holdfast import {} --meters-per-unit {:g} -o CLIP", source,
                  posture.meters_per_unit));
}

double LegLength(const SourceMotion& motion, const SkeletonMap& map) {
  double sum = 0.0;
  for (const auto& [hip, knee, ankle] : {std::array{1, 4, 7}, {2, 5, 8}}) {
    const auto at = [&](int joint) { return motion.positions[0].col(map.source[joint]); };
    sum += (at(hip) - at(knee)).norm() + (at(knee) - at(ankle)).norm();
  }
  return 0.5 * sum;
}

MotionUp FindMotionUp(const SourceMotion& motion, const SkeletonMap& map) {
  MotionUp up;
  const int head = map.source[kHead] >= 0 ? map.source[kHead] : map.source[12];
  if (head < 0) return up;
  const double leg = LegLength(motion, map);
  std::array<std::vector<double>, 3> component;
  std::array<int, 3> nearest = {0, 0, 0};
  for (const Eigen::Matrix3Xd& positions : motion.positions) {
    const Eigen::Vector3d along = HeadOverFeet(positions, map, head);
    int axis = 0;
    along.cwiseAbs().maxCoeff(&axis);
    ++nearest[axis];
    for (int k = 0; k < 3; ++k) component[k].push_back(along[k]);
  }
  const int axis = static_cast<int>(std::ranges::max_element(nearest) - nearest.begin());
  const double along = Median(component[axis]);
  const double share = double(nearest[axis]) / motion.NumFrames();
  if (share < 0.6) return up;

  // Lying looks like standing along another axis. Standing is accepted if the rest pose stands
  // along it too, or if the floor is at zero along it and not along the rest pose's axis.
  Eigen::Matrix3Xd rest = motion.rest_offsets;
  for (int j = 0; j < motion.NumJoints(); ++j) {
    if (motion.parents[j] >= 0) rest.col(j) += rest.col(motion.parents[j]);
  }
  const Eigen::Vector3d resting = HeadOverFeet(rest, map, head);
  int rest_axis = 1;
  if (resting.norm() > leg) resting.cwiseAbs().maxCoeff(&rest_axis);
  const int sign = along < 0 ? -1 : 1;
  constexpr double kStandingLegs = 1.4;  // head over ankles: 1.7 legs upright, 1.2 on all fours
  const bool stands = std::fabs(along) > kStandingLegs * leg;
  const std::vector<double> lowest = LowestAlong(motion, axis, sign);
  const bool floor_here = std::fabs(Median(lowest)) < 0.25 * leg;
  const auto on_floor = std::ranges::count_if(
      lowest, [&](double height) { return height > -0.03 * leg && height < 0.12 * leg; });
  const bool stays_on_floor = static_cast<double>(on_floor) > 0.8 * motion.NumFrames();
  // No joint of a lying body is below the floor; of a body standing at the origin, some joints are
  // behind it.
  const double under = Median(LowestAlong(motion, rest_axis, 1));
  const bool floor_at_rest_axis = under > -0.05 * leg && under < 0.25 * leg;
  const bool customary = axis == 1 && sign > 0;
  const bool along_rest = axis == rest_axis && std::fabs(along) > 0.8 * leg;
  if (along_rest ||
      (stands && floor_here && (customary || stays_on_floor || !floor_at_rest_axis))) {
    return {static_cast<UpAxis>(2 * axis + (sign < 0 ? 1 : 0)), share, true};
  }
  return up;
}

std::vector<Discontinuity> FindDiscontinuities(const LooseMotion& motion, double meters_per_unit) {
  constexpr double kMinTurn_rad = 0.6, kMinMove_m = 0.15;
  std::vector<Discontinuity> leaps;
  if (motion.frames < 3) return leaps;
  const auto count = static_cast<std::size_t>(motion.frames - 1);
  std::vector<double> steps(count);
  const auto look = [&](const std::string& what, double least, bool turns) {
    for (std::size_t k = 0; k < count; ++k) {
      if (IsLeap(steps, k, least)) {
        leaps.push_back({static_cast<int>(k) + 1, what, steps[k], turns});
      }
    }
  };
  for (int joint = 0; joint < kNumJoints; ++joint) {
    for (std::size_t k = 0; k < count; ++k) {
      const Eigen::Vector3d a = motion.pose[k].col(joint), b = motion.pose[k + 1].col(joint);
      // The angle is at most the distance of the vectors.
      steps[k] =
          (a - b).norm() < kMinTurn_rad / 6.0 ? (a - b).norm() : AngleBetween(ExpSO3(a), ExpSO3(b));
    }
    look(std::string(kJointNames[joint]), kMinTurn_rad, true);
  }
  const auto moves = [&](const Eigen::Matrix3Xd& points, const char* what) {
    for (std::size_t k = 0; k < count; ++k) {
      steps[k] = meters_per_unit * (points.col(static_cast<Eigen::Index>(k) + 1) -
                                    points.col(static_cast<Eigen::Index>(k)))
                                       .norm();
    }
    look(what, kMinMove_m, false);
  };
  if (motion.has_trans) moves(motion.trans, "the root's position");
  if (motion.has_object) {
    moves(motion.object_trans, "the object's position");
    for (std::size_t k = 0; k < count; ++k) {
      steps[k] = AngleBetween(motion.object_rotation[k], motion.object_rotation[k + 1]);
    }
    look("the object", kMinTurn_rad, true);
  }
  std::ranges::stable_sort(leaps, {}, &Discontinuity::frame);
  const auto same_frame = [](const Discontinuity& a, const Discontinuity& b) {
    return a.frame == b.frame;
  };
  leaps.erase(std::unique(leaps.begin(), leaps.end(), same_frame), leaps.end());
  return leaps;
}

std::vector<JointLimitViolation> FindOverbends(const LooseMotion& motion) {
  std::vector<JointLimitViolation> bends;
  for (int joint = 1; joint < kNumJoints; ++joint) {
    JointLimitViolation bend{joint, 0, 0, 0.0, LimitDegrees(joint) * kDegree};
    for (int t = 0; t < motion.frames; ++t) {
      const double angle = Angle(motion.pose[t].col(joint));
      if (angle <= bend.limit_rad) continue;
      if (bend.frames++ == 0) bend.first_frame = t;
      bend.worst_rad = std::max(bend.worst_rad, angle);
    }
    if (bend.frames > 0) bends.push_back(bend);
  }
  std::ranges::stable_sort(bends, std::greater(), &JointLimitViolation::frames);
  return bends;
}

double HingeAgreement(const LooseMotion& motion) {
  constexpr double kBent_rad = 0.6;
  double sum = 0.0;
  int count = 0;
  for (const JointPose& pose : motion.pose) {
    for (const auto& [joint, axis] : {std::pair{4, 0}, {5, 0}, {18, 1}, {19, 1}}) {
      const Eigen::Vector3d w = pose.col(joint);
      if (w.norm() < kBent_rad) continue;
      sum += std::fabs(w[axis]) / w.norm();
      ++count;
    }
  }
  return count == 0 ? -1.0 : sum / count;
}

}  // namespace holdfast
