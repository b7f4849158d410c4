// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "generator/nn/random_stream.h"
#include "generator/wandr/intention.h"
#include "generator/wandr/network.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/rollout.h"
#include "geometry/body/skeleton.h"
#include "solver/body_ik/foot_lift.h"
#include "solver/reach/reach_options.h"

namespace holdfast {

/// Predicts a goal that is observed frame by frame: it continues at its current velocity, which
/// decays with a time constant of 0.6 s. A goal that jumps (by more than 0.15 m in a frame, 4.5
/// m/s) is reset to zero velocity.
class GoalPrediction {
 public:
  /// World, meters, 1/30 s after the previous goal.
  void See(const Eigen::Vector3d& goal) {
    constexpr double kJump = 0.15, kGain = 0.3;
    const Eigen::Vector3d way = seen_ ? Eigen::Vector3d(goal - goal_) : Eigen::Vector3d::Zero();
    if (way.norm() > kJump) {
      velocity_.setZero();
    } else {
      velocity_ += kGain * (way * kFrameRate - velocity_);
    }
    goal_ = goal;
    seen_ = true;
  }
  /// Predicted position `frames` after the last observation.
  Eigen::Vector3d After(double frames) const {
    constexpr double kFade_s = 0.6;
    return goal_ - kFade_s * std::expm1(-frames / (kFrameRate * kFade_s)) * velocity_;
  }
  const Eigen::Vector3d& Velocity() const { return velocity_; }  ///< m/s

 private:
  static constexpr double kFrameRate = 30.0;
  Eigen::Vector3d goal_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
  bool seen_ = false;
};

struct FollowOptions {
  Side side = Side::kRight;
  int candidates = 48;  ///< motions tried per frame; time is proportional to candidates and horizon
  int horizon = 14;     ///< frames of lookahead
  double sigma = 0.7;   ///< of newly drawn latents
  std::uint64_t seed = 1;
};

/// Makes a person follow an arbitrarily moving goal of the wrist, online at 30 Hz: the output for a
/// frame depends only on the goals up to it.
///
///   GoalFollower follower(StandingPerson(BodyModel::Default()), wandr::DefaultNetwork());
///   while (...) show(follower.Step(goal_now));
///
/// The arm reaches for goals that are or will come within reach; to more distant goals the person
/// walks upright with swinging arms (SwingArms) and raises the arm in time. In every frame the
/// network is rolled out with several latent samples, including the last frame's best, and with
/// intentions of different lookahead, some to a place beyond the goal, so that people step after a
/// goal instead of leaning; the motion of least cost (FollowCost) gives the next pose.
/// Then feet are pinned (FootPinner), and trunk and arm move the wrist to the goal as far as it is
/// in reach (PlaceWrist), along a separate path of limited speed, so that the hand does not jump
/// when the goal does. Network and body form a closed loop: the drag of pinned feet is fed back to
/// the network.
class GoalFollower {
 public:
  /// Starts from the last frame of `person`. `network` is copied into a runnable one. Throws Error
  /// for invalid options.
  GoalFollower(const ReachPerson& person, const wandr::NetworkWeights& network,
               const FollowOptions& options = {});
  ~GoalFollower();
  GoalFollower(GoalFollower&&) noexcept;

  /// Returns the pose 1/30 s later, for the wrist's current `goal` (world, meters, z up). The first
  /// call returns frame 1 of the motion; frame 0 is the start. Throws Error for a goal that is not
  /// finite, below the ground, or more than 20 m from the pelvis.
  wandr::Pose<double> Step(const Eigen::Vector3d& goal);
  /// Displaces the body by `by` (world, meters, at most 1 m) over the next 0.3 s; its feet stay as
  /// long as possible.
  void Push(const Eigen::Vector3d& by);

 private:
  struct Loop;
  std::unique_ptr<Loop> loop_;
};

/// Cost of one frame of a candidate motion, approximately in meters: distance of the right wrist
/// from the goal (while reaching), distance of the pelvis from a stance for reaching, heading
/// error, lack of a stance foot (the better of both: its slide and height), soles in the ground,
/// trunk tilt over 8 degrees, imbalance, unnecessarily bent knees, and a pelvis faster than
/// walking.
class FollowCost {
 public:
  static constexpr float kNear = 0.30f, kFar = 0.42f;  ///< the stance: meters from goal to pelvis
  static constexpr float kHanging = 0.8f;              ///< meters: height of a hanging wrist

  explicit FollowCost(const wandr::BoneOffsets<float>& bones, float sole_z) : bones_(bones) {
    // Heights of ankles and balls while standing.
    wandr::Pose<float> rest;
    wandr::BodyKinematics<float> placed;
    wandr::ForwardKinematics(bones, rest, placed);
    for (std::size_t k = 0; k < kFeet.size(); ++k) stands_[k] = placed.joints(1, kFeet[k]) - sole_z;
    pelvis_ = placed.joints(1, kPelvis) - sole_z;
  }

  void Place(const wandr::Pose<float>& pose, wandr::BodyKinematics<float>& out) const {
    wandr::ForwardKinematics(bones_, pose, out);
  }

  /// `reaches`: 0 walks to the goal with free arms, 1 has the wrist at the goal.
  float operator()(const wandr::BodyKinematics<float>& before,
                   const wandr::BodyKinematics<float>& now, const Eigen::Vector3f& goal,
                   float reaches) const {
    const auto& joints = now.joints;
    const Eigen::Vector3f pelvis = joints.col(kPelvis), way = goal - pelvis;
    const float away = way.head<2>().norm();
    // How far the goal is below a hanging wrist: people bend and crouch that far.
    const float below = std::max(0.0f, kHanging - goal.z());
    const float bends = reaches > 0.0f ? std::min(1.0f, below / 0.2f) : 0.0f;
    float cost = reaches * std::sqrt((joints.col(kRightWrist) - goal).squaredNorm() + 0.0025f);
    cost += 1.5f * std::max(0.0f, away - kFar) + 1.5f * std::max(0.0f, kNear - away);
    const Eigen::Vector3f forward = wandr::HeadingOf<float>(now.world[0]).Forward();
    if (away > 0.2f) cost += 0.15f * (1.0f - forward.head<2>().dot(way.head<2>()) / away);
    cost += 0.1f * Carries(before, now, cost);
    const Eigen::Vector3f neck = joints.col(kNeck), trunk = (neck - pelvis).normalized();
    cost += (4.0f - 3.6f * bends) * std::max(0.0f, 0.99f - trunk.z());
    cost += 2.0f * std::max(0.0f, OffFeet(joints, 0.5f * (neck + pelvis)) - 0.08f);
    cost += 2.0f * std::max(0.0f, pelvis_ - 0.05f - below - pelvis.z());
    cost += 0.3f * std::max(0.0f, 30.0f * (pelvis - before.joints.col(0)).norm() - kFastest);
    return cost;
  }

 private:
  static constexpr float kFastest = 1.5f;  // m/s

  // Support error of the better foot; ground penetration is added to `cost`.
  float Carries(const wandr::BodyKinematics<float>& before, const wandr::BodyKinematics<float>& now,
                float& cost) const {
    float carries = 10.0f;
    for (const int foot : {0, 1}) {
      float moves = 0.0f, high = 1.0f;
      for (const int k : {foot, foot + 2}) {
        const int joint = kFeet[k];
        const float height = now.joints(2, joint) - stands_[k];
        cost += 3.0f * std::max(0.0f, -height - 0.02f);
        high = std::min(high, std::max(0.0f, height - 0.02f));
        moves += 0.5f * 30.0f * (now.joints.col(joint) - before.joints.col(joint)).head<2>().norm();
      }
      carries = std::min(carries, moves + 10.0f * high);
    }
    return carries;
  }

  // Horizontal distance of a point from the line between the feet.
  template <typename Joints>
  static float OffFeet(const Joints& joints, const Eigen::Vector3f& point) {
    const auto middle = [&](int ankle, int ball) {
      return Eigen::Vector2f(0.5f * (joints.col(ankle) + joints.col(ball)).template head<2>());
    };
    const Eigen::Vector2f left = middle(kLeftAnkle, kLeftFoot);
    const Eigen::Vector2f across = middle(kRightAnkle, kRightFoot) - left;
    const float along = std::clamp(
        across.dot(point.head<2>() - left) / std::max(across.squaredNorm(), 1e-4f), 0.0f, 1.0f);
    return (left + along * across - point.head<2>()).norm();
  }

  static constexpr std::array<int, 4> kFeet = {kLeftAnkle, kRightAnkle, kLeftFoot, kRightFoot};
  wandr::BoneOffsets<float> bones_;
  std::array<float, 4> stands_ = {};
  float pelvis_ = 0.0f;  // height while standing
};

}  // namespace holdfast
