// SPDX-License-Identifier: MIT
#include "generator/scripted/reach_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "generator/body/limb_ik.h"
#include "generator/body/pose_builder.h"
#include "generator/nn/random_stream.h"
#include "generator/scripted/minimum_jerk.h"
#include "geometry/body/skeleton.h"
#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::array<int, 3> kSpine = {kSpine1, kSpine2, kSpine3};

// The rest pose is y up and faces +z; the world is z up and the person faces -y.
const Matrix3d kWorldFromRest = (Matrix3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished();

Matrix3d TurnX(double angle) { return ExpSO3(angle * Vector3d::UnitX()); }
Matrix3d TurnY(double angle) { return ExpSO3(angle * Vector3d::UnitY()); }
Matrix3d TurnZ(double angle) { return ExpSO3(angle * Vector3d::UnitZ()); }

// max(0, x) with a rounded corner of width `soft`.
double SoftPositive(double x, double soft = 0.1) {
  return 0.5 * (x + std::sqrt(x * x + soft * soft));
}

// Smooth minimum, never greater than either argument.
double SoftMin(double a, double b, double soft) {
  return std::min(a, b) - soft * std::log1p(std::exp(-std::abs(a - b) / soft));
}

// Values of the key channels at one time.
struct Targets {
  Vector3d wrist;
  Matrix3d hand;
  double twist, lean, shift, give, grasp, gaze, head_tilt;
};

class Channels {
 public:
  explicit Channels(const std::vector<ReachKey>& keys)
      : reference_(keys.front().hand), spline_(Waypoints(keys)) {}

  Targets At(double time) const {
    const Eigen::VectorXd v = spline_.Value(time);
    return {v.head<3>(),
            reference_ * ExpSO3(v.segment<3>(3)),
            v[6],
            v[7],
            v[8],
            v[9],
            std::clamp(v[10], 0.0, 1.0),
            std::clamp(v[11], 0.0, 1.0),
            v[12]};
  }
  double EndTime() const { return spline_.EndTime(); }

 private:
  // Converts orientations to rotation vectors relative to the first key, unwrapped over the keys.
  std::vector<Waypoint> Waypoints(const std::vector<ReachKey>& keys) const {
    std::vector<Waypoint> waypoints;
    Vector3d turn = Vector3d::Zero();
    for (const ReachKey& key : keys) {
      turn = UnwrapAxisAngle(LogSO3(reference_.transpose() * key.hand), turn);
      Eigen::VectorXd value(13);
      value << key.wrist, turn, key.torso_twist_rad, key.torso_lean_rad, key.weight_shift,
          key.knee_give_m, key.grasp, key.gaze, key.head_tilt_rad;
      waypoints.push_back({key.time_s, value, key.rest});
    }
    return waypoints;
  }

  Matrix3d reference_;
  MinimumJerkSpline spline_;
};

// Slow oscillations of a standing body: each is a sum of three sines with incommensurate periods
// and phases from the seed.
class Sway {
 public:
  Sway(std::uint64_t seed, double amount) : amount_(amount) {
    RandomDraws draws(seed);
    for (double& phase : phases_) phase = draws.Uniform(0.0, 2.0 * std::numbers::pi);
  }
  double Drift(int channel, double time) const {
    static constexpr std::array<double, 3> kHertz = {0.17, 0.29, 0.47};
    double sum = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      sum += std::sin(2.0 * std::numbers::pi * kHertz[k] * time + phases_[3 * channel + k]) /
             static_cast<double>(k + 1);
    }
    return amount_ * 0.55 * sum;
  }
  double Breath(double time) const {
    return amount_ * std::sin(2.0 * std::numbers::pi * 0.26 * time + phases_.back());
  }

 private:
  double amount_;
  std::array<double, 3 * 6 + 1> phases_{};
};

class Person {
 public:
  Person(const BodyMeasures& body, const ScriptedReachOptions& options)
      : joints_(body.rest_joints),
        sole_y_(body.sole_y),
        options_(options),
        sway_(options.seed, options.liveliness) {
    for (const Side side : {Side::kRight, Side::kLeft}) {
      const double sign = side == Side::kRight ? 1.0 : -1.0;
      const Vector3d ankle = joints_.col(Leg(side).end) - joints_.col(kPelvis);
      Foot& foot = side == Side::kRight ? right_foot_ : left_foot_;
      foot.rotation = kWorldFromRest * TurnY(-sign * options.toe_out_rad);
      foot.ankle = kWorldFromRest * Vector3d(options.stance_width * ankle.x(), 0.0, ankle.z());
      foot.ankle.y() += sign * 0.012;  // staggers the feet slightly
      foot.ankle.z() = joints_.col(Leg(side).end).y() - sole_y_;
    }
    relaxed_ = RelaxedFingers(joints_, OtherSide(options.side));
  }

  PoseBuilder Frame(double time, const Channels& channels) const {
    const Targets now = channels.At(time);
    PoseBuilder pose(joints_, Vector3d::Zero());
    Trunk(pose, now, time);
    HoldingArm(pose, now);
    HangingArm(pose, now, channels.At(time - 0.15));
    Gaze(pose, now, channels.At(time + 0.12), time);
    return pose;
  }

 private:
  struct Foot {
    Vector3d ankle;     // world
    Matrix3d rotation;  // world
  };

  // Poses pelvis, spine and legs, which carry the arms.
  void Trunk(PoseBuilder& pose, const Targets& now, double time) const {
    const double lean = now.lean + 0.25 * kDegree * sway_.Drift(0, time);
    const double roll = 2.0 * kDegree * now.shift;  // the hip over the standing leg rises
    pose.SetLocal(kPelvis,
                  kWorldFromRest * TurnY(0.35 * now.twist) * TurnX(0.2 * lean) * TurnZ(roll));
    for (const int joint : kSpine) {
      const double share = 1.0 / 3.0;
      const double breath = joint == kSpine3 ? -0.5 * kDegree * sway_.Breath(time) : 0.0;
      pose.SetLocal(joint, TurnY(0.65 * share * now.twist) * TurnX(0.8 * share * lean + breath) *
                               TurnZ(-share * roll));
    }
    // The pelvis shifts over the loaded foot, and backward as the trunk leans forward.
    Vector3d pelvis(0.035 * now.shift + 0.004 * sway_.Drift(1, time),
                    0.16 * now.lean + 0.004 * sway_.Drift(2, time), 0.0);
    pelvis.z() = PelvisHeight(pose, pelvis) - now.give;
    pose.SetPelvis(pelvis);
    for (const Side side : {Side::kRight, Side::kLeft}) {
      const Limb leg = Leg(side);
      const Foot& foot = side == Side::kRight ? right_foot_ : left_foot_;
      // Knees point in the direction of the toes, and partly in that of the pelvis.
      const Vector3d pole = foot.rotation * Vector3d(0.0, 0.0, 1.0) +
                            0.4 * (pose.World(kPelvis) * Vector3d(0.0, 0.0, 1.0));
      const LimbPose solved = SolveLimb(joints_, leg, pose.Position(leg.root), foot.ankle, pole);
      pose.SetWorld(leg.root, solved.upper);
      pose.SetWorld(leg.middle, solved.lower);
      pose.SetWorld(leg.end, foot.rotation);
    }
  }

  // Maximum height for both legs with the knees slightly bent.
  double PelvisHeight(const PoseBuilder& pose, const Vector3d& pelvis) const {
    std::array<double, 2> height{};
    for (const Side side : {Side::kRight, Side::kLeft}) {
      Limb leg = Leg(side);
      leg.min_flexion_rad = 6.0 * kDegree;
      const Foot& foot = side == Side::kRight ? right_foot_ : left_foot_;
      const Vector3d hip = pose.World(kPelvis) * (joints_.col(leg.root) - joints_.col(kPelvis));
      const double reach = MaxReach(joints_, leg);
      const double across = (foot.ankle - pelvis - hip).head<2>().norm();
      height[side == Side::kRight ? 0 : 1] =
          foot.ankle.z() - hip.z() + std::sqrt(std::max(0.0, reach * reach - across * across));
    }
    return SoftMin(height[0], height[1], 0.003);
  }

  // The collarbone lifts and reaches with the arm (scapulohumeral rhythm, roughly 1 : 3).
  void Collar(PoseBuilder& pose, Side side, const Vector3d& wrist) const {
    const double sign = side == Side::kRight ? 1.0 : -1.0;
    const Limb arm = Arm(side);
    const Vector3d to_wrist = pose.World(kSpine3).transpose() * (wrist - pose.Position(arm.root));
    const double extent = to_wrist.norm() / MaxReach(joints_, arm);
    const Vector3d direction = to_wrist.normalized();
    const double lift = -0.10 + 0.16 * (1.0 + direction.y()) * std::min(1.0, extent);
    const double forward = 0.16 * extent * SoftPositive(direction.z()) +
                           0.14 * extent * SoftPositive(sign * direction.x());
    pose.SetLocal(arm.root - 3, TurnY(sign * forward) * TurnZ(-sign * lift));
  }

  // The elbow hangs down, somewhat outwards and back relative to the chest. It swings up and out if
  // that relaxes the wrist: the swivel minimizes a sum of squared angles, each relative to a barely
  // noticeable angle.
  Vector3d ElbowDirection(const Matrix3d& chest, const Vector3d& shoulder,
                          const Targets& now) const {
    const Side side = options_.side;
    const double sign = side == Side::kRight ? 1.0 : -1.0;
    const Limb arm = Arm(side);
    const Vector3d hanging = chest * Vector3d(-0.45 * sign, -1.0, -0.30);
    const Vector3d axis = (now.wrist - shoulder).normalized();
    constexpr double kAny = 10.0;
    const WristLimits unlimited{kAny, -kAny, kAny, -kAny, kAny};
    const auto pole = [&](double swivel) -> Vector3d {
      return ExpSO3(-sign * swivel * axis) * hanging;
    };
    const auto discomfort = [&](double swivel) {
      const LimbPose limb = SolveLimb(joints_, arm, shoulder, now.wrist, pole(swivel));
      const WristPose wrist = SolveWrist(joints_, side, limb.lower, now.hand, unlimited);
      const auto square = [](double x) { return x * x; };
      return square(swivel / (24.0 * kDegree)) + square(wrist.flexion_rad / (40.0 * kDegree)) +
             square((wrist.ulnar_rad - 8.0 * kDegree) / (22.0 * kDegree)) +
             square(wrist.twist_rad / (55.0 * kDegree));
    };
    // Coarse steps find the basin; golden-section search finds its minimum.
    double best = 0.0;
    for (double swivel = -30.0 * kDegree; swivel <= 90.0 * kDegree; swivel += 10.0 * kDegree) {
      if (discomfort(swivel) < discomfort(best)) best = swivel;
    }
    double low = best - 10.0 * kDegree;
    double high = best + 10.0 * kDegree;
    while (high - low > 1e-7) {
      const double step = (2.0 - std::numbers::phi) * (high - low);
      if (discomfort(low + step) < discomfort(high - step)) {
        high -= step;
      } else {
        low += step;
      }
    }
    return pole(0.5 * (low + high));
  }

  void HoldingArm(PoseBuilder& pose, const Targets& now) const {
    const Side side = options_.side;
    const Limb arm = Arm(side);
    Collar(pose, side, now.wrist);
    const Vector3d shoulder = pose.Position(arm.root);
    const Vector3d pole = ElbowDirection(pose.World(kSpine3), shoulder, now);
    const LimbPose solved = SolveLimb(joints_, arm, shoulder, now.wrist, pole);
    const WristPose wrist = SolveWrist(joints_, side, solved.lower, now.hand);
    pose.SetWorld(arm.root, solved.upper);
    pose.SetWorld(arm.middle, wrist.lower);
    pose.SetLocal(arm.end, wrist.wrist);
    pose.SetFingers(side, GraspingFingers(joints_, side, now.grasp));
  }

  // Hangs vertically regardless of the trunk, and swings slightly behind the turning trunk.
  void HangingArm(PoseBuilder& pose, const Targets& now, const Targets& before) const {
    const Side side = OtherSide(options_.side);
    const double sign = side == Side::kRight ? 1.0 : -1.0;
    const Limb arm = Arm(side);
    pose.SetLocal(arm.root - 3, TurnZ(sign * 0.09));
    const double lag = now.twist - before.twist;
    const double swing = -sign * 0.6 * lag - 3.0 * kDegree;
    const double away = 11.0 * kDegree + 0.3 * std::abs(lag);
    const Matrix3d chest = kWorldFromRest * TurnY(now.twist);
    const Vector3d along = (joints_.col(arm.middle) - joints_.col(arm.root)).normalized();
    const Matrix3d upper = chest * TurnX(-swing) * TurnZ(sign * (0.5 * std::numbers::pi - away)) *
                           ExpSO3(-sign * 0.25 * along);
    pose.SetWorld(arm.root, upper);
    pose.SetLocal(arm.middle, ExpSO3(0.34 * arm.hinge) * ExpSO3(-sign * 0.15 * along));
    pose.SetLocal(arm.end, TurnZ(sign * 4.0 * kDegree));
    pose.SetFingers(side, relaxed_);
  }

  // Eyes and head look ahead of the hand. The head takes most of the rotation, the eyes the rest.
  void Gaze(PoseBuilder& pose, const Targets& now, const Targets& soon, double time) const {
    const Matrix3d chest = pose.World(kSpine3);
    const Vector3d eyes =
        pose.Position(kNeck) +
        chest * (0.5 * (joints_.col(kLeftEye) + joints_.col(kRightEye)) - joints_.col(kNeck));
    const Vector3d hand = soon.wrist + 0.09 * FingerDirection(options_.side, soon.hand);
    const Vector3d direction = (chest.transpose() * (hand - eyes)).normalized();
    const double yaw = now.gaze * std::atan2(direction.x(), direction.z());
    const double pitch =
        now.gaze * std::atan2(-direction.y(), std::hypot(direction.x(), direction.z())) -
        (1.0 - now.gaze) * 0.9 * now.lean;
    const auto limited = [](double angle, double limit) {
      return limit * std::tanh(angle / limit);
    };
    const double head_yaw = limited(0.7 * yaw, 60.0 * kDegree);
    const double head_pitch = limited(0.55 * pitch, 45.0 * kDegree) - now.head_tilt +
                              0.5 * kDegree * sway_.Drift(3, time);
    const double head_roll = 0.10 * head_yaw + 0.4 * kDegree * sway_.Drift(4, time);
    for (const int joint : {kNeck, kHead}) {
      const double share = joint == kNeck ? 0.45 : 0.55;
      pose.SetLocal(
          joint, TurnY(share * head_yaw) * TurnX(share * head_pitch) * TurnZ(-share * head_roll));
    }
    const Matrix3d eye = TurnY(limited(yaw - head_yaw, 25.0 * kDegree)) *
                         TurnX(limited(pitch - head_pitch, 22.0 * kDegree));
    pose.SetLocal(kLeftEye, eye);
    pose.SetLocal(kRightEye, eye);
  }

  const Eigen::Matrix3Xd& joints_;
  double sole_y_;
  ScriptedReachOptions options_;
  Sway sway_;
  Foot right_foot_, left_foot_;
  FingerPose relaxed_;
};

}  // namespace

BodyMeasures MeasureBody(const BodyModel& model, const Eigen::VectorXd& betas) {
  const Eigen::Matrix3Xd vertices = model.ShapedVertices(betas);
  return {model.RestJoints(vertices), vertices.row(1).minCoeff()};
}

Clip MakeReachMotion(const BodyMeasures& body, const std::vector<ReachKey>& keys,
                     const ScriptedReachOptions& options) {
  if (keys.empty()) throw Error("reach motion", "has no keys", "Give at least one");
  if (!(options.frame_rate > 0.0)) {
    throw Error("reach motion", "the frame rate is not positive", "Use 30, for example");
  }
  const Channels channels(keys);
  const Person person(body, options);
  const double duration = options.duration_s > 0.0 ? options.duration_s : channels.EndTime();
  const int frames = static_cast<int>(std::floor(duration * options.frame_rate + 1e-9)) + 1;

  Clip clip;
  clip.frame_rate = options.frame_rate;
  clip.trans.resize(3, frames);
  JointPose previous = JointPose::Zero();
  previous.col(0) = LogSO3(kWorldFromRest);
  for (int t = 0; t < frames; ++t) {
    const PoseBuilder pose = person.Frame(t / options.frame_rate, channels);
    previous = pose.Pose(previous);
    clip.pose.push_back(previous);
    clip.trans.col(t) = pose.Trans();
  }
  return clip;
}

}  // namespace holdfast
